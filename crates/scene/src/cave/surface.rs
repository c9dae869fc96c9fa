//! Shapes of screens: the point of the cave, or the direction from the eye, that each place of a
//! picture shows.
//!
//! ```text
//! frame:            c center, r right, f forward, w up; orthonormal, r = f × w
//! place:            (u, v), 0 to 1 from the lower left corner of the picture
//! cylinder:         a = angle (u − ½),  x = c + R (sin a r + cos a f) + height (v − ½) w
//! equirectangular:  a = angle (u − ½),  e = lowest + (highest − lowest) v,  d = cos e (sin a r + cos a f) + sin e w
//! fisheye:          p = (2u − 1, 2v − 1),  θ = |p| angle / 2,  d = sin θ (p_x r + p_y w) / |p| + cos θ f      |p| ≤ 1
//! cube map:         a cross of 4 x 3 squares, d through the square at distance 1
//!
//!                         up
//!                   left front right back
//!                         down
//!
//! with a radius R:  x = c + R d, a point of a sphere;  without: d, the same from every eye
//! ```
//!
//! The fisheye is the equidistant one, `|p|` proportional to the angle from its middle, as of dome
//! masters.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};

use super::facet::file;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};

/// Axes of a curved screen: orthonormal, right-handed as right, forward, up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFrame {
    /// Middle of the axis of a cylinder, center of a sphere; m, cave axes.
    pub center_m: Point3<f64>,
    /// To the right of the picture: a unit vector.
    pub right: Vector3<f64>,
    /// From the center to the middle of the picture: a unit vector.
    pub forward: Vector3<f64>,
    /// To the top of the picture: a unit vector.
    pub up: Vector3<f64>,
}

/// The shape of a screen.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// A rectangle.
    Flat,
    /// A section of a cylinder around `up`, seen from inside.
    Cylinder {
        /// Axes.
        frame: SurfaceFrame,
        /// Radius, m.
        radius_m: f64,
        /// Height along the axis, m.
        height_m: f64,
        /// Angle from the left to the right edge, rad, at most 2π.
        angle_rad: f64,
    },
    /// Longitude and latitude: a section of a sphere, or of all directions.
    Equirectangular {
        /// Axes.
        frame: SurfaceFrame,
        /// Radius of the sphere, m; `None` for directions from the eye.
        radius_m: Option<f64>,
        /// Angle from the left to the right edge, rad, at most 2π.
        angle_rad: f64,
        /// Elevation of the lower and of the upper edge, rad, −π/2 to π/2.
        elevation_rad: [f64; 2],
    },
    /// A disk around `forward`: a dome master.
    Fisheye {
        /// Axes.
        frame: SurfaceFrame,
        /// Radius of the dome, m; `None` for directions from the eye.
        radius_m: Option<f64>,
        /// Angle across the disk, rad, at most 2π.
        angle_rad: f64,
    },
    /// Six squares of a cube around the eye, as a cross.
    CubeMap {
        /// Axes.
        frame: SurfaceFrame,
    },
    /// Triangles from a file: OBJ or PFM.
    Mesh {
        /// The file.
        file: PathBuf,
    },
}

/// The content of one place of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A point of the screen, m, cave axes.
    Point(Point3<f64>),
    /// A direction from the eye, cave axes, any length.
    Direction(Vector3<f64>),
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Flat,
    Cylinder,
    Equirectangular,
    Fisheye,
    CubeMap,
    Mesh,
}

const SHAPES: Names<Shape> = &[
    ("flat", Shape::Flat),
    ("cylinder", Shape::Cylinder),
    ("equirectangular", Shape::Equirectangular),
    ("fisheye", Shape::Fisheye),
    ("cube_map", Shape::CubeMap),
    ("mesh", Shape::Mesh),
];

const TURN: Bound = Bound::new(1e-3, 360.0, "an angle from 0.001 to 360 degrees");
const LENGTH: Bound = Bound::new(1e-3, 1e6, "a length from 0.001 to 1e6 m");
const ELEVATION: Bound = Bound::new(-90.0, 90.0, "an angle from -90 to 90 degrees");

impl Surface {
    /// Reads `shape` and the keys of that shape; `None`, with the problem recorded, for an unknown one.
    pub(crate) fn read(f: &mut Fields<'_>, folder: &Path) -> Option<Surface> {
        let radians = |degrees: f64| degrees.to_radians();
        let shape = match f.value("shape") {
            Some(value) => f.as_choice("shape", value, SHAPES)?,
            None => Shape::Flat,
        };
        Some(match shape {
            Shape::Flat => Surface::Flat,
            Shape::Cylinder => Surface::Cylinder {
                frame: SurfaceFrame::read(f, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
                radius_m: f.number("radius_m", LENGTH),
                height_m: f.number("height_m", LENGTH),
                angle_rad: radians(f.number_or("angle_deg", TURN, 360.0)),
            },
            Shape::Equirectangular => {
                let frame = SurfaceFrame::read(f, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
                let radius_m = f.optional_number("radius_m", LENGTH);
                let angle_rad = radians(f.number_or("angle_deg", TURN, 360.0));
                let [low, high]: [f64; 2] = f.vector_or("elevation_deg", ELEVATION, [-90.0, 90.0]);
                if low >= high {
                    let message = format!("`elevation_deg` of {} is [{low}, {high}]", f.what);
                    f.log.report(f.span.clone(), message, "expected the lower edge below the upper one");
                }
                Surface::Equirectangular { frame, radius_m, angle_rad, elevation_rad: [radians(low), radians(high)] }
            }
            Shape::Fisheye => Surface::Fisheye {
                // a dome master: the zenith in the middle, the front at the lower edge
                frame: SurfaceFrame::read(f, [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]),
                radius_m: f.optional_number("radius_m", LENGTH),
                angle_rad: radians(f.number_or("angle_deg", TURN, 180.0)),
            },
            Shape::CubeMap => Surface::CubeMap { frame: SurfaceFrame::read(f, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) },
            Shape::Mesh => {
                f.required("mesh_file", "a file that ends in .obj or .pfm");
                Surface::Mesh { file: file(f, "mesh_file", folder, &["obj", "pfm"]).unwrap_or_default() }
            }
        })
    }

    /// Returns what the place `(u, v)` of the picture shows, 0 to 1 from its lower left corner;
    /// `None` outside the disk of a fisheye and the squares of a cube map, and for shapes that are
    /// not formulas: flat screens and meshes.
    pub fn at(&self, [u, v]: [f64; 2]) -> Option<Place> {
        let around = |frame: &SurfaceFrame, a: f64| frame.right * libm::sin(a) + frame.forward * libm::cos(a);
        match self {
            Surface::Flat | Surface::Mesh { .. } => None,
            Surface::Cylinder { frame, radius_m, height_m, angle_rad } => {
                let out = around(frame, angle_rad * (u - 0.5));
                Some(Place::Point(frame.center_m + out * *radius_m + frame.up * (height_m * (v - 0.5))))
            }
            Surface::Equirectangular { frame, radius_m, angle_rad, elevation_rad: [low, high] } => {
                let e = low + (high - low) * v;
                let d = around(frame, angle_rad * (u - 0.5)) * libm::cos(e) + frame.up * libm::sin(e);
                Some(frame.place(*radius_m, d))
            }
            Surface::Fisheye { frame, radius_m, angle_rad } => {
                let p = [2.0 * u - 1.0, 2.0 * v - 1.0];
                let r = libm::hypot(p[0], p[1]);
                if r > 1.0 {
                    return None;
                }
                let theta = 0.5 * angle_rad * r;
                // sin θ / r has the limit angle / 2 in the middle
                let share = if r > 1e-12 { libm::sin(theta) / r } else { 0.5 * angle_rad };
                let d = (frame.right * p[0] + frame.up * p[1]) * share + frame.forward * libm::cos(theta);
                Some(frame.place(*radius_m, d))
            }
            Surface::CubeMap { frame } => {
                let (column, row) = ((4.0 * u).floor().clamp(0.0, 3.0), (3.0 * v).floor().clamp(0.0, 2.0));
                let (a, b) = (2.0 * (4.0 * u - column) - 1.0, 2.0 * (3.0 * v - row) - 1.0);
                let (r, f, w) = (frame.right, frame.forward, frame.up);
                let (across, upward, out) = match (column as u32, row as u32) {
                    (0, 1) => (f, w, -r),
                    (1, 1) => (r, w, f),
                    (2, 1) => (-f, w, r),
                    (3, 1) => (-r, w, -f),
                    (1, 2) => (r, -f, w),
                    (1, 0) => (r, f, -w),
                    _ => return None,
                };
                Some(Place::Direction(out + across * a + upward * b))
            }
        }
    }

    /// Returns the distance of a point inside a curved screen, m, negative outside; infinity for
    /// shapes without an inside.
    pub(crate) fn distance_m(&self, point: &Point3<f64>) -> f64 {
        match self {
            Surface::Cylinder { frame, radius_m, .. } => {
                let from = point - frame.center_m;
                radius_m - (from - frame.up * from.dot(&frame.up)).norm()
            }
            Surface::Equirectangular { frame, radius_m: Some(radius_m), .. }
            | Surface::Fisheye { frame, radius_m: Some(radius_m), .. } => radius_m - (point - frame.center_m).norm(),
            _ => f64::INFINITY,
        }
    }

    /// Returns width and height of the picture: m along a cylinder or a sphere; for directions, as
    /// on a sphere of radius 1 m. `None` for flat screens and meshes.
    pub(crate) fn size_m(&self) -> Option<[f64; 2]> {
        let angles = match self {
            Surface::Flat | Surface::Mesh { .. } => return None,
            Surface::Cylinder { radius_m, height_m, angle_rad, .. } => return Some([radius_m * angle_rad, *height_m]),
            Surface::Equirectangular { angle_rad, elevation_rad: [low, high], .. } => [*angle_rad, high - low],
            Surface::Fisheye { angle_rad, .. } => [*angle_rad; 2],
            Surface::CubeMap { .. } => [8.0, 6.0],
        };
        Some(angles.map(|a| self.radius_m() * a))
    }

    /// The radius of a cylinder or sphere, m; 1 for other shapes.
    pub(crate) fn radius_m(&self) -> f64 {
        match self {
            Surface::Cylinder { radius_m, .. } => *radius_m,
            Surface::Equirectangular { radius_m, .. } | Surface::Fisheye { radius_m, .. } => radius_m.unwrap_or(1.0),
            _ => 1.0,
        }
    }

    /// The axes, if the shape has some.
    pub fn frame(&self) -> Option<&SurfaceFrame> {
        match self {
            Surface::Flat | Surface::Mesh { .. } => None,
            Surface::Cylinder { frame, .. }
            | Surface::Equirectangular { frame, .. }
            | Surface::Fisheye { frame, .. }
            | Surface::CubeMap { frame } => Some(frame),
        }
    }
}

impl SurfaceFrame {
    fn read(f: &mut Fields<'_>, forward: [f64; 3], up: [f64; 3]) -> SurfaceFrame {
        let problems = f.log.count();
        let center_m = Point3::from(f.vector_or("center_m", Bound::ANY, [0.0; 3]));
        let forward = Vector3::from(f.direction_or("forward", forward));
        let up = Vector3::from(f.direction_or("up", up));
        let right = forward.cross(&up);
        if f.log.count() == problems && right.norm() < 1e-3 {
            let message = format!("`forward` of {} is parallel to its `up`", f.what);
            f.log.report(f.span.clone(), message, "expected two directions that are not parallel");
        }
        let right = right.normalize();
        // the axis of a cylinder is exact, and the middle of its picture perpendicular to it
        SurfaceFrame { center_m, right, forward: up.cross(&right), up }
    }

    fn place(&self, radius_m: Option<f64>, d: Vector3<f64>) -> Place {
        match radius_m {
            Some(radius_m) => Place::Point(self.center_m + d * radius_m),
            None => Place::Direction(d),
        }
    }
}
