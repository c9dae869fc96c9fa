//! Frames of a model: `<pose relative_to="…">` resolved to poses in the frame of the model.
//!
//! ```text
//! X_MF = X_MR·X_RF        R is the frame that `relative_to` names; without it:
//!     a link or a frame attached to nothing    the model
//!     a frame attached to A                    A
//!     a joint                                  its child link
//! ```

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Quaternion, Unit};
use tumble_core::collide::Pose;

use super::value::{numbers, text, wrong};
use crate::parse::bound::Bound;
use crate::parse::rotation;
use crate::xml::Element;

/// Name of the frame of the model itself.
pub(super) const MODEL: &str = "__model__";

/// The named frames of a model.
pub(super) struct Frames<'a, 'd> {
    known: BTreeMap<&'a str, Named<'a, 'd>>,
    /// The link that a joint of the model itself moves.
    canonical: Option<&'a str>,
    /// Whether axes are in the frame of the model unless they say another, as before version 1.5.
    pub(super) axes_in_model: bool,
}

struct Named<'a, 'd> {
    element: Element<'a, 'd>,
    /// The frame of its pose unless `relative_to` says another.
    base: &'a str,
    is_link: bool,
    /// In the model, once it is known.
    pose: Option<Pose>,
}

impl<'a, 'd> Frames<'a, 'd> {
    /// Collects links, joints and frames. A name that is used twice is a problem.
    pub(super) fn of(model: &Element<'a, 'd>) -> Frames<'a, 'd> {
        let version = model.node().ancestors().find_map(|node| node.attribute("version"));
        let canonical = model.text("canonical_link").filter(|name| !name.is_empty());
        let mut frames = Frames {
            known: BTreeMap::new(),
            canonical: canonical.or_else(|| model.child("link").and_then(|link| link.text("name"))),
            axes_in_model: version.and_then(|version| version.parse().ok()).is_some_and(|version: f64| version < 1.45),
        };
        for tag in ["link", "joint", "frame"] {
            for element in model.children(tag) {
                let Some(name) = element.required_text("name", "a unique name") else { continue };
                let base = match tag {
                    "joint" => super::value::child_text(&element, "child").unwrap_or(MODEL),
                    "frame" => element.text("attached_to").filter(|name| !name.is_empty()).unwrap_or(MODEL),
                    _ => MODEL,
                };
                if name.contains("::") || name == MODEL || name == "world" {
                    element.wrong("name", "a name without `::` that is not reserved");
                } else if let Some(first) = frames.known.get(name) {
                    let message = format!("has the name of {} at {}", first.element.what(), first.element.place());
                    element.problem(message, "expected a unique name among links, joints and frames");
                } else {
                    frames.known.insert(name, Named { element, base, is_link: tag == "link", pose: None });
                }
            }
        }
        frames
    }

    /// Returns the pose of a link, joint or frame in the model. A loop, or a name that is not known, is a
    /// problem.
    pub(super) fn pose(&mut self, name: &str) -> Option<Pose> {
        // the frames from the named one to one whose pose is known
        let (mut chain, mut at): (Vec<(&'a str, Pose)>, &str) = (Vec::new(), name);
        let mut seen = BTreeSet::new();
        let mut pose = loop {
            if at == MODEL {
                break Pose::identity();
            }
            let (own, named) = self.known.get_key_value(at)?;
            if let Some(pose) = named.pose {
                break pose;
            }
            if !seen.insert(*own) {
                named.element.problem("has a pose relative to itself", "expected frames without loops");
                return None;
            }
            let (relative, base) = read_pose(&named.element);
            let to = base.unwrap_or(named.base);
            if to != MODEL && !self.known.contains_key(to) {
                return self.unknown(&named.element, to);
            }
            chain.push((own, relative));
            at = to;
        };
        for (name, relative) in chain.into_iter().rev() {
            pose *= relative;
            if let Some(named) = self.known.get_mut(name) {
                named.pose = Some(pose);
            }
        }
        Some(pose)
    }

    /// Returns the link that a link, joint or frame belongs to, or that the model itself stands for. `None` if there is none.
    pub(super) fn link_of(&self, name: &'a str) -> Option<&'a str> {
        let mut at = name;
        for _ in 0..=self.known.len() {
            if at == MODEL {
                return self.canonical;
            }
            let named = self.known.get(at)?;
            if named.is_link {
                return Some(at);
            }
            at = named.base;
        }
        None
    }

    /// Returns the pose of `<pose>` in an element, in the frame of `base`.
    pub(super) fn pose_in(&mut self, element: &Element<'_, '_>, base: &str) -> Pose {
        let (relative, to) = read_pose(element);
        let Some(to) = to.filter(|to| *to != base) else { return relative };
        if to != MODEL && !self.known.contains_key(to) {
            self.unknown(element, to);
            return relative;
        }
        match (self.pose(base), self.pose(to)) {
            (Some(base), Some(to)) => base.inverse() * to * relative,
            _ => relative,
        }
    }

    /// Records that no frame has this name.
    pub(super) fn unknown(&self, element: &Element<'_, '_>, name: &str) -> Option<Pose> {
        let near = crate::parse::suggest::nearest(name, self.known.keys().copied());
        let expected = match near {
            _ if name.contains("::") => "expected a frame of this model; nested models are not supported".into(),
            Some(near) => format!("did you mean \"{near}\"?"),
            None => "expected the name of a link, joint or frame of this model".to_owned(),
        };
        let name: String = name.chars().take(48).collect();
        element.problem(format_args!("is relative to \"{name}\""), expected);
        None
    }
}

/// Reads `<pose>` of an element, and the frame that it is relative to.
fn read_pose<'a>(element: &Element<'a, '_>) -> (Pose, Option<&'a str>) {
    let Some(pose) = element.child("pose") else { return (Pose::identity(), None) };
    let to = pose.text("relative_to").or(pose.text("frame")).filter(|name| !name.is_empty());
    (pose_of(&pose), to)
}

/// Reads the numbers of `<pose>`: a position and roll, pitch, yaw, or a quaternion.
pub(super) fn pose_of(pose: &Element<'_, '_>) -> Pose {
    if text(pose).is_empty() {
        return Pose::identity();
    }
    if pose.text("rotation_format") == Some("quat_xyzw") {
        let Some([x, y, z, i, j, k, w]) = numbers::<7>(pose, Bound::ANY) else { return Pose::identity() };
        let Some(rotation) = Unit::try_new(Quaternion::new(w, i, j, k), 1e-9) else {
            wrong(pose, "a quaternion x y z w that is not 0 after the position");
            return Pose::identity();
        };
        return rotation::pose([x, y, z], rotation.coords.into());
    }
    let Some([x, y, z, roll, pitch, yaw]) = numbers::<6>(pose, Bound::ANY) else { return Pose::identity() };
    let degrees = matches!(pose.text("degrees"), Some("true" | "1"));
    let angles = [roll, pitch, yaw].map(|angle| if degrees { angle.to_radians() } else { angle });
    rotation::pose([x, y, z], rotation::roll_pitch_yaw(angles))
}
