//! `<compiler>`: how the numbers of a model are read; poses in all their notations.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, Unit};
use tumble_core::collide::{Pose, Quat, Vec3};

use super::defaults::{FLAGS, Item};
use super::notes::Ledger;
use super::schema;
use super::source::XmlNode;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// The bodies whose mass is that of their geoms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FromGeoms {
    /// Those without `<inertial>`.
    Missing,
    Always,
    Never,
}

/// Settings of `<compiler>`.
pub(super) struct Compiler {
    pub(super) degrees: bool,
    pub(super) autolimits: bool,
    /// Axes, and whether each turns with the rotations before it.
    eulerseq: [(usize, bool); 3],
    pub(super) mesh_folder: PathBuf,
    pub(super) strippath: bool,
    pub(super) from_geoms: FromGeoms,
    /// Groups of the geoms that have mass.
    pub(super) mass_groups: [i64; 2],
    pub(super) least_mass: f64,
    pub(super) least_inertia: f64,
    pub(super) balance: bool,
    /// Mass of the whole model, kg.
    pub(super) total_mass: Option<f64>,
}

const ANGLES: &[(&str, bool)] = &[("degree", true), ("radian", false)];
const FROM_GEOMS: &[(&str, FromGeoms)] =
    &[("auto", FromGeoms::Missing), ("true", FromGeoms::Always), ("false", FromGeoms::Never)];

impl Compiler {
    /// Reads all elements `<compiler>`; a later one overrides an earlier one.
    pub(super) fn read(root: &XmlNode<'_>, folder: &Path, notes: &Ledger) -> Compiler {
        let mut c = Compiler {
            degrees: true,
            autolimits: true,
            eulerseq: [(0, true), (1, true), (2, true)],
            mesh_folder: folder.to_path_buf(),
            strippath: false,
            from_geoms: FromGeoms::Missing,
            mass_groups: [0, 5],
            least_mass: 0.0,
            least_inertia: 0.0,
            balance: false,
            total_mass: None,
        };
        for XmlNode { element, .. } in root.all("compiler") {
            schema::COMPILER_ATTRIBUTES.check(element, notes);
            c.degrees = element.word("angle", ANGLES).unwrap_or(c.degrees);
            c.autolimits = element.word("autolimits", FLAGS).unwrap_or(c.autolimits);
            c.balance = element.word("balanceinertia", FLAGS).unwrap_or(c.balance);
            c.strippath = element.word("strippath", FLAGS).unwrap_or(c.strippath);
            c.from_geoms = element.word("inertiafromgeom", FROM_GEOMS).unwrap_or(c.from_geoms);
            c.least_mass = element.number("boundmass", Bound::NOT_NEGATIVE).unwrap_or(c.least_mass);
            c.least_inertia = element.number("boundinertia", Bound::NOT_NEGATIVE).unwrap_or(c.least_inertia);
            c.total_mass = element.number("settotalmass", Bound::ANY).filter(|mass| *mass > 0.0).or(c.total_mass);
            if let Some([low, high]) = element.numbers("inertiagrouprange", Bound::ANY) {
                c.mass_groups = [low as i64, high as i64];
            }
            for name in ["assetdir", "meshdir"] {
                if let Some(path) = element.text(name) {
                    c.mesh_folder = folder.join(path);
                }
            }
            if let Some(sequence) = element.text("eulerseq") {
                match euler_axes(sequence) {
                    Some(axes) => c.eulerseq = axes,
                    None => {
                        element.wrong("eulerseq", "three letters of x, y, z (turning axes) and X, Y, Z (fixed axes)")
                    }
                }
            }
            if element.text("coordinate").is_some_and(|word| word != "local") {
                element.wrong("coordinate", "local: global coordinates are no longer part of MJCF");
            }
        }
        c
    }

    /// Returns an angle of the file in radians.
    pub(super) fn angle(&self, value: f64) -> f64 {
        if self.degrees { value.to_radians() } else { value }
    }

    /// Returns `pos` and the orientation of an element.
    pub(super) fn pose(&self, item: &Item<'_>) -> Pose {
        let position = item.numbers("pos").unwrap_or([0.0; 3]);
        Pose::from_parts(Translation3::from(Vec3::from(position)), self.orientation(item))
    }

    /// Returns the orientation of an element: `quat`, `axisangle`, `euler`, `xyaxes` or `zaxis`.
    pub(super) fn orientation(&self, item: &Item<'_>) -> Quat {
        const WAYS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];
        let Some(element) = item.at_any(&WAYS) else { return Quat::identity() };
        let given: Vec<&str> = WAYS.into_iter().filter(|way| element.text(way).is_some()).collect();
        if given.len() > 1 {
            let message = format!("has both `{}` and `{}`", given[0], given[1]);
            element.problem(message, "expected one orientation");
        }
        self.read_orientation(element, given[0]).unwrap_or_else(Quat::identity)
    }

    fn read_orientation(&self, element: &Element<'_, '_>, way: &str) -> Option<Quat> {
        let numbers = |count| element.list(way, count, Bound::ANY).filter(|list| list.len() == count);
        let wrong = |expected: &str| {
            element.wrong(way, expected);
            None
        };
        match way {
            "quat" => {
                let Some(q) = numbers(4) else { return wrong("four numbers w, x, y, z") };
                Unit::try_new(Quaternion::new(q[0], q[1], q[2], q[3]), 1e-10)
                    .or_else(|| wrong("a quaternion w, x, y, z that is not 0"))
            }
            "axisangle" => {
                let Some(a) = numbers(4) else { return wrong("an axis and an angle: four numbers") };
                let axis = Unit::try_new(Vec3::new(a[0], a[1], a[2]), 1e-10);
                match axis {
                    Some(axis) => Some(about(&axis, self.angle(a[3]))),
                    None => wrong("an axis that is not 0, and an angle"),
                }
            }
            "euler" => {
                let Some(angles) = numbers(3) else { return wrong("three angles") };
                let step = |so_far: Quat, ((axis, turning), angle): ((usize, bool), f64)| {
                    let turn = about(&Unit::new_unchecked(Vec3::ith(axis, 1.0)), self.angle(angle));
                    if turning { so_far * turn } else { turn * so_far }
                };
                Some(self.eulerseq.into_iter().zip(angles).fold(Quat::identity(), step))
            }
            "xyaxes" => {
                let Some(a) = numbers(6) else { return wrong("the x axis and the y axis: six numbers") };
                let x = Vec3::new(a[0], a[1], a[2]).try_normalize(1e-10);
                let y = x.and_then(|x| {
                    let y = Vec3::new(a[3], a[4], a[5]);
                    (y - x * x.dot(&y)).try_normalize(1e-10)
                });
                match (x, y) {
                    (Some(x), Some(y)) => {
                        let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
                        Some(Quat::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)))
                    }
                    _ => wrong("two directions that are not parallel"),
                }
            }
            _ => {
                let Some(z) = numbers(3) else { return wrong("a direction: three numbers") };
                match Vec3::new(z[0], z[1], z[2]).try_normalize(1e-10) {
                    Some(z) => Some(turn_z_to(&z)),
                    None => wrong("a direction: three numbers, not all 0"),
                }
            }
        }
    }
}

/// Returns the smallest rotation that takes the z axis to a unit vector; half a turn about x for
/// its opposite, as in MuJoCo.
pub(crate) fn turn_z_to(to: &Vec3) -> Quat {
    let axis = Vec3::z().cross(to);
    let (sine, cosine) = (axis.norm(), to.z);
    match Unit::try_new(axis, 1e-10) {
        Some(axis) => about(&axis, libm::atan2(sine, cosine)),
        None if cosine > 0.0 => Quat::identity(),
        None => about(&Vec3::x_axis(), std::f64::consts::PI),
    }
}

/// Returns the rotation by `angle` radians about an axis, with the same bits on every platform.
pub(super) fn about(axis: &Unit<Vec3>, angle: f64) -> Quat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    let v = axis.into_inner() * sin;
    Unit::new_normalize(Quaternion::new(cos, v.x, v.y, v.z))
}

fn euler_axes(sequence: &str) -> Option<[(usize, bool); 3]> {
    let axis = |letter: char| {
        let at = "xyz".find(letter.to_ascii_lowercase())?;
        Some((at, letter.is_ascii_lowercase()))
    };
    let axes: Vec<_> = sequence.chars().take(4).map(axis).collect::<Option<_>>()?;
    axes.try_into().ok()
}
