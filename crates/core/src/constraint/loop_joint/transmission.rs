//! Constants of joints that transmit motion.

use super::LoopJointKind;
use tumble_collide::{Pose, Vec3};

/// Constants of gears, racks, screws and pulleys; each kind uses its own.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Transmission {
    /// Teeth of the gears A and B, not 0: `n_A·θ_A + n_B·θ_B = 0`. A negative number is a gear with
    /// inner teeth: both turn the same way.
    pub teeth: [i32; 2],
    /// Displacement of a rack per radian of its pinion, m, not 0: `s_B = radius·θ_A`.
    pub radius: f64,
    /// Displacement of a screw per turn, m, not 0: `s = pitch·θ/2π`. Positive for a right-handed one.
    pub pitch: f64,
    /// Weight of the side of B in the length of a pulley, above 0.
    pub ratio: f64,
    /// Points of the world over which the rope of a pulley runs, m.
    pub ground: [Vec3; 2],
    /// Frames of A and B in the world at which gears and racks have position 0, and a pulley has the length that it
    /// gets by default.
    pub references: [Pose; 2],
}

impl Default for Transmission {
    fn default() -> Transmission {
        Transmission {
            teeth: [1, 1],
            radius: 1.0,
            pitch: 1.0,
            ratio: 1.0,
            ground: [Vec3::zeros(); 2],
            references: [Pose::identity(); 2],
        }
    }
}

impl Transmission {
    /// Returns the length of a pulley's rope at the frames of reference, m.
    pub(super) fn rope_length(&self) -> f64 {
        let [a, b] = [0, 1].map(|k| (self.references[k].translation.vector - self.ground[k]).norm());
        a + self.ratio * b
    }

    /// Returns the first constant that joints of a kind do not have, and that is not the default one.
    pub(super) fn foreign_to(&self, kind: LoopJointKind) -> Option<&'static str> {
        let usual = Transmission::default();
        let changed = [
            ("teeth", self.teeth != usual.teeth),
            ("radius", self.radius != usual.radius),
            ("pitch", self.pitch != usual.pitch),
            ("ratio", self.ratio != usual.ratio),
            ("ground", self.ground != usual.ground),
        ];
        changed
            .into_iter()
            .find(|(parameter, changed)| *changed && !kind.has(parameter))
            .map(|(parameter, _)| parameter)
    }

    /// Returns the first constant out of its range: name, value, admissible range.
    pub(super) fn range_error(&self) -> Option<(&'static str, f64, &'static str)> {
        let not_zero =
            |what, value: f64| (!value.is_finite() || value == 0.0).then_some((what, value, "finite and not 0"));
        let [a, b] = self.teeth.map(f64::from);
        let numbers = self.ground.iter().flat_map(|point| point.iter().copied());
        let frames = self.references.iter().flat_map(|frame| {
            frame.translation.vector.iter().chain(frame.rotation.coords.iter()).copied().collect::<Vec<f64>>()
        });
        let infinite = numbers.chain(frames).find(|x| !x.is_finite());
        not_zero("the number of teeth of a", a)
            .or(not_zero("the number of teeth of b", b))
            .or(not_zero("the radius", self.radius))
            .or(not_zero("the pitch", self.pitch))
            .or((!(self.ratio.is_finite() && self.ratio > 0.0)).then_some((
                "the ratio",
                self.ratio,
                "finite and above 0",
            )))
            .or(infinite.map(|x| ("a point or frame of the world", x, "finite")))
    }
}
