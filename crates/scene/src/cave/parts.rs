//! `[[user]]`, `[[screen]]`, `[[node]]`: the viewers, the screens, and the machines that draw.

use std::net::IpAddr;
use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::checks;
use super::surface::Surface;
use crate::parse::bound::Bound;
use crate::parse::fields::Fields;

/// A viewer.
#[derive(Clone, Debug, PartialEq)]
pub struct User {
    /// Unique among users.
    pub name: String,
    /// The point between the eyes, m, cave axes.
    pub eye_m: Point3<f64>,
    /// Direction in which the user faces: a unit vector. Default y. Stereo eyes are to the right
    /// and left of it; mono does not use it.
    pub forward: Vector3<f64>,
    /// Up direction of the user: a unit vector. Default z.
    pub up: Vector3<f64>,
    /// Interpupillary distance, m, 0 to 0.2. Default 0.063.
    pub interpupillary_m: f64,
}

const PUPILS: Bound = Bound::new(0.0, 0.2, "a length from 0 to 0.2 m");

impl User {
    pub(crate) fn read(mut f: Fields<'_>) -> Option<User> {
        let name = read_name(&mut f)?;
        let problems = f.log.count();
        let user = User {
            name,
            eye_m: Point3::from(f.vector("eye_m", Bound::ANY)),
            forward: Vector3::from(f.direction_or("forward", [0.0, 1.0, 0.0])),
            up: Vector3::from(f.direction_or("up", [0.0, 0.0, 1.0])),
            interpupillary_m: f.number_or("interpupillary_m", PUPILS, 0.063),
        };
        if f.log.count() == problems && user.forward.cross(&user.up).norm() < 1e-3 {
            let message = format!("`forward` of {} is parallel to its `up`", f.what);
            f.log.report(f.span.clone(), message, "expected two directions that are not parallel");
        }
        f.finish();
        Some(user)
    }

    /// Returns the direction to the user's right: a unit vector.
    pub fn right(&self) -> Vector3<f64> {
        self.forward.cross(&self.up).normalize()
    }

    /// Returns the position of the eye on `side` (−1 left, 0 between, +1 right): `eye + side · ipd
    /// / 2 · right`, m, cave axes.
    pub fn eye(&self, side: f64) -> Point3<f64> {
        self.eye_m + self.right() * (0.5 * side * self.interpupillary_m)
    }
}

/// A screen: a flat rectangle with a front, or a curved one.
///
/// Curved screens have the corners of a stand-in: the rectangle of the picture's width and height
/// that touches the screen in the middle of the picture. Only its size has a meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Screen {
    /// Unique among screens.
    pub name: String,
    /// The shape.
    pub surface: Surface,
    /// Lower left corner as seen from the front, m, cave axes.
    pub lower_left_m: Point3<f64>,
    /// Lower right corner as seen from the front, m, cave axes.
    pub lower_right_m: Point3<f64>,
    /// Upper left corner as seen from the front, m, cave axes.
    pub upper_left_m: Point3<f64>,
}

impl Screen {
    pub(crate) fn read(mut f: Fields<'_>, folder: &Path) -> Option<Screen> {
        let name = read_name(&mut f)?;
        let problems = f.log.count();
        let Some(surface) = Surface::read(&mut f, folder) else {
            // the other keys depend on the shape; the name is known to facets
            f.give_up();
            let [lower_left_m, lower_right_m, upper_left_m] = [Point3::origin(); 3];
            return Some(Screen { name, surface: Surface::Flat, lower_left_m, lower_right_m, upper_left_m });
        };
        let [lower_left_m, lower_right_m, upper_left_m] = match &surface {
            Surface::Flat => {
                ["lower_left_m", "lower_right_m", "upper_left_m"].map(|key| Point3::from(f.vector(key, Bound::ANY)))
            }
            curved => stand_in(curved),
        };
        let screen = Screen { name, surface, lower_left_m, lower_right_m, upper_left_m };
        if f.log.count() == problems && screen.is_flat() {
            checks::screen(&screen, &f);
        }
        f.finish();
        Some(screen)
    }

    /// Returns whether it is a flat rectangle.
    pub fn is_flat(&self) -> bool {
        self.surface == Surface::Flat
    }

    /// Returns the lower edge from left to right, m.
    pub fn across(&self) -> Vector3<f64> {
        self.lower_right_m - self.lower_left_m
    }

    /// Returns the left edge from bottom to top, m.
    pub fn upward(&self) -> Vector3<f64> {
        self.upper_left_m - self.lower_left_m
    }

    /// Returns the fourth corner, m.
    pub fn upper_right_m(&self) -> Point3<f64> {
        self.upper_left_m + self.across()
    }

    /// Returns the normal on the front: a unit vector.
    pub fn normal(&self) -> Vector3<f64> {
        self.across().cross(&self.upward()).normalize()
    }

    /// Returns width and height, m.
    pub fn size_m(&self) -> [f64; 2] {
        [self.across().norm(), self.upward().norm()]
    }

    /// Returns the distance of a point in front of the screen's plane, m, negative behind it; of
    /// curved screens the distance inside their cylinder or sphere, infinity without one.
    pub fn distance_m(&self, point: &Point3<f64>) -> f64 {
        match &self.surface {
            Surface::Flat => (point - self.lower_left_m).dot(&self.normal()),
            curved => curved.distance_m(point),
        }
    }
}

/// Returns the corners of the rectangle that stands for a curved screen: lower left, lower right,
/// upper left. A mesh, whose file is not read here, gets a square of 1 m.
fn stand_in(curved: &Surface) -> [Point3<f64>; 3] {
    let [wide, high] = curved.size_m().unwrap_or([1.0; 2]);
    let (middle, right, up) = match curved.frame() {
        Some(frame) => (frame.center_m + frame.forward * curved.radius_m(), frame.right, frame.up),
        None => (Point3::new(0.0, 1.0, 0.0), Vector3::x(), Vector3::z()),
    };
    [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)].map(|(a, b)| middle + right * (a * wide) + up * (b * high))
}

/// A machine that draws facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Unique among nodes.
    pub name: String,
    /// An IP address or a host name.
    pub address: String,
    /// Words of the command that starts a facet on the node; empty if facets are started by hand.
    /// The words may have [`LAUNCH_PLACEHOLDERS`].
    pub launch: Vec<String>,
}

/// Placeholders in the words of `launch`, written in braces. `{arguments}`, a word by itself,
/// stands for all words after `tumble`; `{line}` for the same as one string for a shell.
pub const LAUNCH_PLACEHOLDERS: [&str; 5] = ["address", "node", "facet", "arguments", "line"];
/// Largest number of words of a launch command.
const MAX_LAUNCH_WORDS: usize = 64;

impl Node {
    pub(crate) fn read(mut f: Fields<'_>) -> Option<Node> {
        let name = read_name(&mut f)?;
        let address = f.text("address", "an IP address or a host name, such as \"127.0.0.1\"");
        if let Some((text, value)) = address.filter(|(text, _)| !is_address(text)) {
            let port =
                text.rsplit_once(':').is_some_and(|(host, port)| is_address(host) && port.parse::<u16>().is_ok());
            f.wrong(
                "address",
                value,
                if port {
                    "an address without a port; the server's is `port` of [sync]"
                } else {
                    "an IP address or a host name"
                },
            );
        }
        let launch = read_launch(&mut f);
        f.finish();
        Some(Node { name, address: address.map_or(String::new(), |(text, _)| text.to_owned()), launch })
    }

    /// Returns whether the address is this machine: 127.x.x.x, ::1 or `localhost`.
    pub fn is_local(&self) -> bool {
        self.address == "localhost" || self.address.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
    }
}

fn read_launch(f: &mut Fields<'_>) -> Vec<String> {
    let expected = "the words of a command, such as [\"ssh\", \"{address}\", \"tumble {line}\"]";
    let place = f.value("launch");
    let words: Vec<String> = f
        .list("launch", MAX_LAUNCH_WORDS, expected)
        .into_iter()
        .filter_map(|item| f.as_text("launch", item))
        .map(str::to_owned)
        .collect();
    let Some(place) = place else { return words };
    let unknown = words.iter().find_map(|word| braces(word).find(|inside| !LAUNCH_PLACEHOLDERS.contains(inside)));
    if let Some(unknown) = unknown {
        f.wrong(
            "launch",
            place,
            format!("only {{{}}} in braces; there is no {{{unknown}}}", LAUNCH_PLACEHOLDERS.join("}, {")),
        );
    } else if words.iter().any(|word| word.contains("{arguments}") && word != "{arguments}") {
        f.wrong("launch", place, "{arguments} as a word by itself; within a word it is {line}");
    } else if words.first().is_none_or(|word| word.is_empty())
        || !words.iter().any(|word| word == "{arguments}" || word.contains("{line}"))
    {
        f.wrong("launch", place, format!("{expected}, with {{arguments}} or {{line}} among them"));
    }
    words
}

/// Returns the texts in braces.
fn braces(text: &str) -> impl Iterator<Item = &str> {
    text.split('{').skip(1).filter_map(|rest| rest.split_once('}').map(|(inside, _)| inside))
}

/// Returns whether a text is an IP address or a host name: letters, digits, hyphens, and dots
/// between them.
fn is_address(text: &str) -> bool {
    let label = |label: &str| {
        !label.is_empty()
            && label.len() <= 63
            && label.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
    };
    text.parse::<IpAddr>().is_ok() || (text.len() <= 253 && text.split('.').all(label))
}

/// The names that are allowed.
pub(crate) const NAME: &str = "1 to 64 letters, digits, _ - . and inner spaces";

/// Returns whether a name is allowed.
pub(crate) fn is_name(name: &str) -> bool {
    (1..=64).contains(&name.chars().count())
        && name.chars().all(|c| c.is_alphanumeric() || "_- .".contains(c))
        && name.trim() == name
}

/// Reads the `name` of a table, which messages use from then on. `None`, with the problem recorded,
/// if it has none.
pub(crate) fn read_name(f: &mut Fields<'_>) -> Option<String> {
    let kind = f.what.split(' ').next().unwrap_or("part").to_owned();
    let Some((name, value)) = f.text("name", "a text") else {
        // The other keys do not depend on the name, so they are read even without one.
        return Some(String::new());
    };
    if !is_name(name) {
        f.wrong("name", value, NAME);
    }
    f.what = format!("{kind} \"{name}\"");
    Some(name.to_owned())
}
