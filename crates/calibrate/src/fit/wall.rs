//! The surfaces of the room that projectors light.
//!
//! ```text
//! flat:      place (s, t) of x:  s = (x − a)·u / |u|²,  t = (x − a)·v / |v|²        a lower left, u across, v upward
//! moved:     turned about its middle by (m₁, m₂) along u and v, then by m₀ along its normal
//! cylinder, sphere:  center + (m₀, m₁, m₂),  radius + m₃
//! ```

use nalgebra::{Point3, Rotation3, Vector3};
use tumble_scene::cave::{Screen, Surface, SurfaceFrame};

/// Numbers of a wall's move: m, rad.
pub(crate) const MOVE: usize = 4;

/// A surface, seen from its front or from inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wall {
    Flat {
        corner: Point3<f64>,
        across: Vector3<f64>,
        upward: Vector3<f64>,
    },
    Cylinder {
        frame: SurfaceFrame,
        radius: f64,
        height: f64,
        angle: f64,
    },
    /// A disk of directions around `forward`.
    Dome {
        frame: SurfaceFrame,
        radius: f64,
        angle: f64,
    },
    /// Longitudes and latitudes.
    Globe {
        frame: SurfaceFrame,
        radius: f64,
        angle: f64,
        elevation: [f64; 2],
    },
}

impl Wall {
    /// Returns the surface of a screen.
    ///
    /// # Errors
    /// The fault of a screen that is no surface with a formula.
    pub fn of(screen: &Screen) -> Result<Wall, String> {
        let expected = "expected flat, or a cylinder, fisheye or equirectangular with radius_m";
        Ok(match &screen.surface {
            Surface::Flat => {
                Wall::Flat { corner: screen.lower_left_m, across: screen.across(), upward: screen.upward() }
            }
            Surface::Cylinder { frame, radius_m, height_m, angle_rad } => {
                Wall::Cylinder { frame: *frame, radius: *radius_m, height: *height_m, angle: *angle_rad }
            }
            Surface::Fisheye { frame, radius_m: Some(radius), angle_rad } => {
                Wall::Dome { frame: *frame, radius: *radius, angle: *angle_rad }
            }
            Surface::Equirectangular { frame, radius_m: Some(radius), angle_rad, elevation_rad } => {
                Wall::Globe { frame: *frame, radius: *radius, angle: *angle_rad, elevation: *elevation_rad }
            }
            Surface::Fisheye { .. } | Surface::Equirectangular { .. } => {
                return Err(format!("has no radius_m; {expected}"));
            }
            Surface::CubeMap { .. } => return Err(format!("has the shape cube_map; {expected}")),
            Surface::Mesh { .. } => return Err(format!("has the shape mesh; {expected}")),
        })
    }

    pub fn is_flat(&self) -> bool {
        matches!(self, Wall::Flat { .. })
    }

    /// Standard deviations of a move of a wall whose points are known within `sigma_m`.
    pub fn move_sigmas(&self, sigma_m: f64) -> [f64; MOVE] {
        match self {
            Wall::Flat { across, upward, .. } => {
                [sigma_m, 2.0 * sigma_m / upward.norm(), 2.0 * sigma_m / across.norm(), 1.0]
            }
            _ => [sigma_m; MOVE],
        }
    }

    /// Returns the wall at another place.
    pub fn moved(&self, m: &[f64]) -> Wall {
        let shifted =
            |frame: &SurfaceFrame| SurfaceFrame { center_m: frame.center_m + Vector3::new(m[0], m[1], m[2]), ..*frame };
        match self {
            Wall::Flat { corner, across, upward } => {
                let turn = Rotation3::new(across.normalize() * m[1] + upward.normalize() * m[2]);
                let normal = across.cross(upward).normalize();
                let middle = corner + 0.5 * (across + upward) + normal * m[0];
                let (across, upward) = (turn * across, turn * upward);
                Wall::Flat { corner: middle - 0.5 * (across + upward), across, upward }
            }
            Wall::Cylinder { frame, radius, height, angle } => {
                Wall::Cylinder { frame: shifted(frame), radius: radius + m[3], height: *height, angle: *angle }
            }
            Wall::Dome { frame, radius, angle } => {
                Wall::Dome { frame: shifted(frame), radius: radius + m[3], angle: *angle }
            }
            Wall::Globe { frame, radius, angle, elevation } => {
                Wall::Globe { frame: shifted(frame), radius: radius + m[3], angle: *angle, elevation: *elevation }
            }
        }
    }

    /// Returns where a ray from the front or from inside meets the surface, continued without end: the share
    /// of the ray's length, positive.
    pub fn hit(&self, from: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
        // the far root of |from + t ray − c|² = R²
        let far = |o: Vector3<f64>, d: Vector3<f64>, radius: f64| {
            let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - radius * radius);
            let root = b * b - a * c;
            (root >= 0.0 && c < 0.0 && a > 0.0).then(|| (root.sqrt() - b) / a)
        };
        match self {
            Wall::Flat { corner, across, upward } => {
                let n = across.cross(upward);
                let (distance, toward) = ((from - corner).dot(&n), -ray.dot(&n));
                (distance > 0.0 && toward > 0.0).then(|| distance / toward)
            }
            Wall::Cylinder { frame, radius, .. } => {
                let flat = |v: Vector3<f64>| v - frame.up * v.dot(&frame.up);
                far(flat(from - frame.center_m), flat(*ray), *radius)
            }
            Wall::Dome { frame, radius, .. } | Wall::Globe { frame, radius, .. } => {
                far(from - frame.center_m, *ray, *radius)
            }
        }
    }

    /// Returns the place of a point of the surface in the screen's picture: 0 to 1 from the lower left.
    pub fn place(&self, point: &Point3<f64>) -> [f64; 2] {
        match self {
            Wall::Flat { corner, across, upward } => {
                let d = point - corner;
                [d.dot(across) / across.norm_squared(), d.dot(upward) / upward.norm_squared()]
            }
            Wall::Cylinder { frame, height, angle, .. } => {
                let d = point - frame.center_m;
                [d.dot(&frame.right).atan2(d.dot(&frame.forward)) / angle + 0.5, d.dot(&frame.up) / height + 0.5]
            }
            Wall::Dome { frame, angle, .. } => {
                let d = (point - frame.center_m).normalize();
                let (x, y) = (d.dot(&frame.right), d.dot(&frame.up));
                let side = x.hypot(y);
                let theta = side.atan2(d.dot(&frame.forward));
                let share = if side > 1e-12 { theta / side } else { 1.0 } / angle;
                [0.5 + x * share, 0.5 + y * share]
            }
            Wall::Globe { frame, angle, elevation: [low, high], .. } => {
                let d = (point - frame.center_m).normalize();
                let e = d.dot(&frame.up).clamp(-1.0, 1.0).asin();
                [d.dot(&frame.right).atan2(d.dot(&frame.forward)) / angle + 0.5, (e - low) / (high - low)]
            }
        }
    }

    /// Returns whether a point of the surface lies on the screen, continued by `margin` shares of the picture.
    pub fn holds(&self, point: &Point3<f64>, margin: f64) -> bool {
        let place = self.place(point);
        match self {
            Wall::Dome { .. } => (place[0] - 0.5).hypot(place[1] - 0.5) <= 0.5 + margin,
            _ => place.iter().all(|s| (-margin..=1.0 + margin).contains(s)),
        }
    }
}

/// Returns the nearest wall that a ray meets, and the point there.
pub(crate) fn nearest(
    walls: &[Wall],
    from: &Point3<f64>,
    ray: &Vector3<f64>,
    margin: f64,
) -> Option<(usize, Point3<f64>)> {
    let mut best: Option<(f64, usize, Point3<f64>)> = None;
    for (i, wall) in walls.iter().enumerate() {
        let Some(t) = wall.hit(from, ray) else { continue };
        let point = from + ray * t;
        if best.is_none_or(|(least, ..)| t < least) && wall.holds(&point, margin) {
            best = Some((t, i, point));
        }
    }
    best.map(|(_, i, point)| (i, point))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble_scene::cave::{Place, resolve_cave};

    /// Places and points are each other's inverse, by the formulas of cave files.
    #[test]
    fn places_are_those_of_the_screens() {
        for name in ["curve", "dome", "cylinder5", "cube4"] {
            for screen in &resolve_cave(name).unwrap().load().unwrap().screens {
                let wall = Wall::of(screen).unwrap();
                for place in [[0.5, 0.5], [0.3, 0.6], [0.7, 0.2], [0.55, 0.9]] {
                    let point = match screen.surface.at(place) {
                        Some(Place::Point(point)) => point,
                        _ => screen.lower_left_m + screen.across() * place[0] + screen.upward() * place[1],
                    };
                    let back = wall.place(&point);
                    assert!((0..2).all(|k| (back[k] - place[k]).abs() < 1e-9), "{name}: {place:?} {back:?}");
                    let eye = Point3::new(0.1, -0.2, 1.6);
                    let t = wall.hit(&eye, &(point - eye)).unwrap();
                    assert!((t - 1.0).abs() < 1e-9, "{name}: {t}");
                }
            }
        }
    }
}
