//! Bounds of the items of a list: for cameras, for the fit of shadow maps, for the reach of
//! effects.

use super::{DrawList, Instance};
use crate::Camera;
use nalgebra::{Matrix4, Point3, Vector3};

/// Corners `(min, max)` of a box along the world axes.
pub(crate) type Bounds = (Point3<f32>, Point3<f32>);

/// Items farther from the middle of the visible box than this multiple of its radius are not fitted
/// into shadow maps. A body that fell off the floor must not blur the shadows of the rest.
const FAR_AWAY: f32 = 4.0;

/// Items farther out than this multiple of the median do not count for a framing camera.
const FLOWN_OFF: f32 = 20.0;

impl DrawList {
    /// Returns a sphere `(center, radius)` around all instances and spheres, or only around shadow
    /// casters if `casters` is set; `None` if there are none. The ground and debug drawings do not
    /// count.
    pub fn bounding_sphere(&self, casters: bool) -> Option<(Point3<f32>, f32)> {
        self.bounding_box(casters).map(|b| sphere_around(&b))
    }

    /// Returns the box `(min, max)` around all instances and spheres, as for
    /// [`DrawList::bounding_sphere`].
    pub fn bounding_box(&self, casters: bool) -> Option<(Point3<f32>, Point3<f32>)> {
        union(self.items(casters).map(|item| item.1))
    }

    /// Returns a camera along `direction` that shows all shadow casters. A wide floor does not
    /// count, and a body that is so far off that the rest would be a dot does not count either.
    /// Without shadow casters it shows the middle of the list, from at most the distance that shows
    /// 5 m around it.
    pub fn framing_camera(&self, direction: Vector3<f32>) -> Camera {
        let floor = || self.bounding_sphere(false).map(|(center, radius)| (center, radius.min(5.0)));
        let (center, radius) =
            self.main_box().map(|b| sphere_around(&b)).or_else(floor).unwrap_or((Point3::origin(), 1.0));
        Camera::framing(center, radius, direction, 0.9)
    }

    /// The box around the shadow casters, without those that lie many times farther from their
    /// median than half of them do.
    fn main_box(&self) -> Option<Bounds> {
        let boxes: Vec<Bounds> = self.items(true).map(|item| item.1).collect();
        let spheres: Vec<_> = boxes.iter().map(sphere_around).collect();
        let middle = Point3::from(std::array::from_fn(|k| median(spheres.iter().map(|(center, _)| center[k]))));
        let reach: Vec<f32> = spheres.iter().map(|(center, radius)| (center - middle).norm() + radius).collect();
        let limit = FLOWN_OFF * median(reach.iter().copied());
        union(boxes.into_iter().zip(reach).filter(|(_, r)| *r <= limit).map(|(b, _)| b))
    }

    /// The box around the shadow casters that are at least partly in a view, by their bounding
    /// spheres; around everything if there are none.
    pub(crate) fn visible_box(&self, clip_from_world: &Matrix4<f32>) -> Option<Bounds> {
        let planes = planes(clip_from_world);
        let seen = |b: &Bounds| {
            let (center, radius) = sphere_around(b);
            planes.iter().all(|p| p.dot(&center.to_homogeneous()) >= -radius)
        };
        union(self.items(true).map(|item| item.1).filter(seen)).or_else(|| self.bounding_box(false))
    }

    /// The box around the shadow casters of the whole world, without distant ones; around
    /// everything if there are none.
    pub(crate) fn whole_box(&self) -> Option<Bounds> {
        self.main_box().or_else(|| self.bounding_box(false))
    }

    /// The median radius of the shadow casters, m; 0 if there are none.
    pub(crate) fn default_radius(&self) -> f32 {
        median(self.items(true).map(|item| sphere_around(&item.1).1))
    }

    /// The shadow casters near the `seen` box. For each: points in the world with a radius around
    /// them that contain it, and its box. The points are eight corners, a sphere's center, or both
    /// ends of a capsule's segment.
    pub(crate) fn casters_near(&self, seen: &Bounds) -> impl Iterator<Item = (Corners, f32, Bounds)> {
        let (middle, radius) = sphere_around(seen);
        self.items(true).filter_map(move |(points, bounds, around)| {
            let (center, own) = sphere_around(&bounds);
            ((center - middle).norm() - own <= FAR_AWAY * radius).then_some((points, around, bounds))
        })
    }

    /// For each item, points and a radius around them that contain it, and its box.
    fn items(&self, casters: bool) -> impl Iterator<Item = (Corners, Bounds, f32)> {
        let meshes: Vec<_> = self.meshes.iter().map(|m| m.bounds()).collect();
        let instances = self.instances.iter().filter(move |i| i.casts_shadow || !casters).filter_map(move |i| {
            let corners = world_corners(i, *meshes.get(i.mesh.0)?)?;
            let bounds = union(corners.iter().map(|&p| (p, p)))?;
            Some((Corners(corners, 8), bounds, 0.0))
        });
        let spheres = self.spheres.iter().filter(move |s| s.casts_shadow || !casters).map(|s| {
            let r = Vector3::repeat(s.radius);
            (Corners([s.center; 8], 1), (s.center - r, s.center + r), s.radius)
        });
        let clouds =
            self.clouds.iter().filter(move |_| !casters).flat_map(|cloud| &cloud.spheres).map(|(center, radius)| {
                let r = Vector3::repeat(*radius);
                (Corners([*center; 8], 1), (center - r, center + r), *radius)
            });
        let soft = self.soft_spheres.iter().filter(move |_| !casters).map(|s| {
            let r = Vector3::repeat(s.radius);
            (Corners([s.center; 8], 1), (s.center - r, s.center + r), s.radius)
        });
        let capsules = self.capsules.iter().filter(move |c| c.casts_shadow || !casters).map(|c| {
            let [a, b] = [-1.0, 1.0].map(|end| c.pose * Point3::new(0.0, 0.0, end * 0.5 * c.length));
            let r = Vector3::repeat(c.radius);
            (Corners([a, b, a, a, a, a, a, a], 2), (a.inf(&b) - r, a.sup(&b) + r), c.radius)
        });
        instances.chain(spheres).chain(clouds).chain(soft).chain(capsules)
    }
}

/// Up to eight points.
pub(crate) struct Corners([Point3<f32>; 8], usize);

impl Corners {
    pub fn iter(&self) -> impl Iterator<Item = &Point3<f32>> {
        self.0[..self.1].iter()
    }
}

/// The eight world corners of an instance's box; none for an empty mesh.
fn world_corners(instance: &Instance, local: Option<([f32; 3], [f32; 3])>) -> Option<[Point3<f32>; 8]> {
    let (lo, hi) = local?;
    Some(
        corners_of(&(lo.into(), hi.into()))
            .map(|p| instance.pose * Point3::from(p.coords.component_mul(&instance.scale))),
    )
}

/// The upper median; 0 without numbers.
fn median(numbers: impl Iterator<Item = f32>) -> f32 {
    let mut all: Vec<f32> = numbers.collect();
    let middle = all.len() / 2;
    if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(middle, f32::total_cmp).1 }
}

/// The smallest box around boxes.
pub(crate) fn union(boxes: impl Iterator<Item = Bounds>) -> Option<Bounds> {
    boxes.reduce(|(lo, hi), (a, b)| (lo.inf(&a), hi.sup(&b)))
}

/// The sphere around a box.
pub(crate) fn sphere_around((lo, hi): &Bounds) -> (Point3<f32>, f32) {
    (nalgebra::center(lo, hi), (hi - lo).norm() / 2.0)
}

/// The eight corners of a box.
pub(crate) fn corners_of((lo, hi): &Bounds) -> [Point3<f32>; 8] {
    std::array::from_fn(|k| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
        Point3::new(pick(0), pick(1), pick(2))
    })
}

/// The six planes of a view, as rows whose product with a homogeneous point is its distance inside
/// (Gribb and Hartmann, 2001).
fn planes(clip_from_world: &Matrix4<f32>) -> [nalgebra::Vector4<f32>; 6] {
    let row = |i: usize| clip_from_world.row(i).transpose();
    let (x, y, z, w) = (row(0), row(1), row(2), row(3));
    [w + x, w - x, w + y, w - y, z, w - z].map(|p| p / p.xyz().norm().max(1e-12))
}
