//! `[camera]`, `[[light]]`, `[sky]`, `[ground]`, `[cave]`: how the scene is drawn. Nothing here has
//! an effect on motion.

use crate::parse::appearance::{AppearanceSpec, Color, Pattern, read_color};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};

/// A fixed camera.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraSpec {
    /// Position of the eye, m.
    pub eye_m: [f64; 3],
    /// The point in the center of the image, m.
    pub target_m: [f64; 3],
    /// A unit vector that points up in the image. Default z.
    pub up: [f64; 3],
    /// Angle between the lower and the upper edge of the image, degrees, 1 to 170. Default 40.
    pub vertical_fov_deg: f64,
    /// Nearest depth drawn, m. Default 0.05.
    pub near_m: f64,
    /// Farthest depth drawn, m. Default 500.
    pub far_m: f64,
}

/// Range of vertical fields of view.
pub(crate) const FOV: Bound = Bound::new(1.0, 170.0, "an angle from 1 to 170 degrees");

impl CameraSpec {
    pub(crate) fn read(mut f: Fields<'_>) -> Self {
        let problems = f.log.count();
        let camera = CameraSpec {
            eye_m: f.vector("eye_m", Bound::ANY),
            target_m: f.vector("target_m", Bound::ANY),
            up: f.direction_or("up", [0.0, 0.0, 1.0]),
            vertical_fov_deg: f.number_or("vertical_fov_deg", FOV, 40.0),
            near_m: f.number_or("near_m", Bound::POSITIVE, 0.05),
            far_m: f.number_or("far_m", Bound::POSITIVE, 500.0),
        };
        if f.log.count() == problems {
            camera.check(&f);
        }
        f.finish();
        camera
    }

    fn check(&self, f: &Fields<'_>) {
        let ahead: [f64; 3] = std::array::from_fn(|k| self.target_m[k] - self.eye_m[k]);
        let [[a, b, c], [x, y, z]] = [ahead, self.up];
        let aside = [b * z - c * y, c * x - a * z, a * y - b * x];
        let length = crate::parse::fields::norm(&ahead);
        if crate::parse::fields::norm(&aside) <= 1e-6 * length || length == 0.0 {
            let message = format!("{} looks along its `up`, or its `target_m` equals its `eye_m`", f.what);
            f.log.report(
                f.span.clone(),
                message,
                "expected a `target_m` that differs from `eye_m` in a direction other than `up`",
            );
        }
        if self.near_m >= self.far_m {
            let message = format!("`near_m` of {} is {} and `far_m` is {}", f.what, self.near_m, self.far_m);
            f.log.report(f.span.clone(), message, "expected near_m less than far_m");
        }
    }
}

/// `[cave]`: the pose of a cave's frame in the scene, upright. `x_scene = origin + scale ·
/// Rz(heading) · x_cave`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CavePlace {
    /// The cave's origin (by convention the floor below its center), m, world axes.
    pub origin_m: [f64; 3],
    /// Rotation about the vertical, counter-clockwise from above, degrees. At 0 the cave's y axis
    /// is the world's.
    pub heading_deg: f64,
    /// Meters of the scene per meter of the cave, 1e-6 to 1e6. Default 1.
    pub scale: f64,
}

impl CavePlace {
    pub(crate) fn read(mut f: Fields<'_>) -> Self {
        let place = CavePlace {
            origin_m: f.vector("origin_m", Bound::ANY),
            heading_deg: f.number_or("heading_deg", Bound::ANY, 0.0),
            scale: f.number_or("scale", Bound::new(1e-6, 1e6, "a factor from 1e-6 to 1e6"), 1.0),
        };
        f.finish();
        place
    }

    /// Returns the place at which `eye` of the cave (m, cave axes), facing `forward`, is at `eye_m`
    /// of the scene and faces along `towards`, as far as an upright cave can. Only the horizontal
    /// part of `towards` counts; without one the heading is 0.
    pub fn standing(eye: [f64; 3], forward: [f64; 3], eye_m: [f64; 3], towards: [f64; 3]) -> Self {
        let bearing = |v: [f64; 3]| (v[0].hypot(v[1]) > 1e-9).then(|| libm::atan2(-v[0], v[1]));
        let heading = bearing(towards).zip(bearing(forward)).map_or(0.0, |(to, from)| to - from);
        let place = CavePlace { origin_m: [0.0; 3], heading_deg: heading.to_degrees(), scale: 1.0 };
        let [x, y, z] = place.to_scene(eye);
        CavePlace { origin_m: [eye_m[0] - x, eye_m[1] - y, eye_m[2] - z], ..place }
    }

    /// Returns a point of the cave in the scene, m.
    pub fn to_scene(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.turned(point);
        let [ox, oy, oz] = self.origin_m;
        [ox + self.scale * x, oy + self.scale * y, oz + self.scale * z]
    }

    /// Returns a direction of the cave in the scene.
    pub fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (s, c) = libm::sincos(self.heading_deg.to_radians());
        [c * x - s * y, s * x + c * y, z]
    }
}

/// A light.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LightSpec {
    /// Directional or point.
    pub kind: LightKind,
    /// sRGB, 0 to 1. Default white.
    pub color: Color,
    /// A directional light of intensity 1 makes a white wall that faces it white; a point light
    /// does so at 1 m. Default 1.
    pub intensity: f64,
    /// Default true for a directional light, false for a point.
    pub casts_shadow: bool,
}

/// The kind and source of a light.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum LightKind {
    /// Parallel rays, like sunlight.
    Directional {
        /// Unit direction in which the light travels, world axes.
        direction: [f64; 3],
    },
    /// Light from a point; it falls off with the square of the distance.
    Point {
        /// World axes, m.
        position_m: [f64; 3],
    },
}

#[derive(Clone, Copy)]
enum Kind {
    Directional,
    Point,
}

const KINDS: Names<Kind> = &[("directional", Kind::Directional), ("point", Kind::Point)];

/// Direction of the default sun: from above, the left and the front.
const SUN: [f64; 3] = [0.36, 0.48, -0.8];

impl LightSpec {
    /// Returns the default light of a scene without lights.
    pub(crate) fn sun() -> Self {
        let kind = LightKind::Directional { direction: SUN };
        LightSpec { kind, color: [1.0, 0.97, 0.92], intensity: 1.0, casts_shadow: true }
    }

    pub(crate) fn read(mut f: Fields<'_>) -> Option<Self> {
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let kind = match kind {
            Kind::Directional => LightKind::Directional { direction: f.direction("direction") },
            Kind::Point => LightKind::Point { position_m: f.vector("position_m", Bound::ANY) },
        };
        let directional = matches!(kind, LightKind::Directional { .. });
        let light = LightSpec {
            kind,
            color: read_color(&mut f, "color", [1.0, 1.0, 1.0]),
            intensity: f.number_or("intensity", Bound::NOT_NEGATIVE, 1.0),
            casts_shadow: f.flag_or("casts_shadow", directional),
        };
        f.finish();
        Some(light)
    }
}

/// The sky: background and ambient light.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SkySpec {
    /// Straight up.
    pub zenith_color: Color,
    /// At the horizon.
    pub horizon_color: Color,
    /// Below the horizon, visible in reflections.
    pub nadir_color: Color,
    /// Strength of the light from the sky. Default 1.3.
    pub intensity: f64,
}

impl Default for SkySpec {
    fn default() -> Self {
        SkySpec {
            zenith_color: [0.20, 0.36, 0.60],
            horizon_color: [0.74, 0.79, 0.84],
            nadir_color: [0.32, 0.31, 0.30],
            intensity: 1.3,
        }
    }
}

impl SkySpec {
    pub(crate) fn read(mut f: Fields<'_>) -> Self {
        let default = SkySpec::default();
        let sky = SkySpec {
            zenith_color: read_color(&mut f, "zenith_color", default.zenith_color),
            horizon_color: read_color(&mut f, "horizon_color", default.horizon_color),
            nadir_color: read_color(&mut f, "nadir_color", default.nadir_color),
            intensity: f.number_or("intensity", Bound::NOT_NEGATIVE, default.intensity),
        };
        f.finish();
        sky
    }
}

/// A horizontal floor that is only drawn. Bodies fall through it unless a half-space is there.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GroundSpec {
    /// Height of the floor, m. Default 0.
    pub height_m: f64,
    /// Default a gray checkerboard of 1 m.
    pub appearance: AppearanceSpec,
}

impl GroundSpec {
    pub(crate) fn read(mut f: Fields<'_>) -> Self {
        let height_m = f.number_or("height_m", Bound::ANY, 0.0);
        let ground = GroundSpec { height_m, appearance: AppearanceSpec::read(&mut f, &Self::default_appearance()) };
        f.finish();
        ground
    }

    /// Returns a gray checkerboard of 1 m.
    pub(crate) fn default_appearance() -> AppearanceSpec {
        AppearanceSpec {
            color: [0.40, 0.41, 0.42],
            second_color: [0.46, 0.47, 0.48],
            pattern: Pattern::Checker,
            pattern_scale_m: 1.0,
            roughness: 0.9,
            ..AppearanceSpec::default()
        }
    }
}
