//! Shapes as `<geom>`, the meshes that they name, and collision groups as bits.
//!
//! Two parts of tumble collide if each is in the mask of the other; in MuJoCo if `contype` of one meets `conaffinity` of the
//! other. Both are the same where the masks of a pair agree.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use tumble_core::collide::{Pose, Shape, TriMesh, Vec3};
use tumble_core::{Appearance, Collidable, CollisionGroup, Material, ShapeFilter, Visual, VisualGeometry, World};

use super::MjcfWriter;
use super::xml::{Attributes, numbers, vector};
use crate::save::shapes::{is_same, obj};

/// Sides of round surfaces that MJCF has no geom for.
const SIDES: usize = 48;
/// Group of geoms that MuJoCo does not draw.
const HIDDEN: &str = "3";
/// Group of geoms that are drawn and do not collide.
const DRAWN: &str = "2";
/// Number of bits of `contype` and `conaffinity` that are used.
const BITS: usize = 31;

/// The bit of each group that a world uses, and the groups that it collides with.
type Kind = (u64, u64);

/// Collision groups of a world, each with a bit of `contype`.
#[derive(Default)]
pub(super) struct Groups {
    used: Vec<u64>,
}

impl Groups {
    /// Returns the groups and notes about masks that MJCF cannot say.
    pub(super) fn of(world: &World) -> (Groups, Vec<&'static str>) {
        let mut kinds: BTreeSet<Kind> = BTreeSet::new();
        for parts in world.ids().iter().filter_map(|id| world.object(*id)?.collidable()) {
            let solid = (0..parts.parts()).filter(|part| parts.shape(*part).is_some());
            for part in solid {
                kinds.insert(kind_of(parts, part));
                kinds.extend(parts.shape_filters(part).iter().map(|(_, own)| (own.group.bit(), own.mask)));
            }
        }
        let mut used: Vec<u64> = kinds.iter().map(|(group, _)| *group).collect();
        used.dedup();
        let mut notes = Vec::new();
        let meets = |(_, mask): &Kind, (group, _): &Kind| mask & group != 0;
        if kinds.iter().any(|a| kinds.iter().any(|b| meets(a, b) != meets(b, a))) {
            notes.push("masks that differ between the two sides of a pair: MuJoCo lets such a pair collide");
        }
        if used.len() > BITS {
            notes.push("more than 31 collision groups: all collide with each other in MuJoCo");
            used.clear();
        }
        (Groups { used }, notes)
    }

    /// Returns `contype` and `conaffinity`.
    fn bits(&self, (group, mask): Kind) -> [u32; 2] {
        let Some(own) = self.used.iter().position(|other| *other == group) else { return [1, 1] };
        let meets = self.used.iter().enumerate().filter(|(_, other)| mask & **other != 0);
        [1 << own, meets.fold(0, |bits, (k, _)| bits | 1 << k)]
    }
}

fn kind_of(parts: &dyn Collidable, part: usize) -> Kind {
    let groups = (0..64).filter_map(CollisionGroup::new);
    let mask = groups.filter(|group| parts.collides_with(part, *group)).fold(0, |mask, group| mask | group.bit());
    (parts.collision_group(part).bit(), mask)
}

/// Meshes of a model, each written once.
#[derive(Default)]
pub(super) struct Assets {
    names: BTreeMap<usize, String>,
    /// Kept so that an address names one mesh.
    kept: Vec<Shape>,
    pub(super) files: Vec<(String, Vec<u8>)>,
    pub(super) elements: Vec<(&'static str, Attributes)>,
}

impl Assets {
    fn add(&mut self, mesh: &TriMesh, folder: &str) -> String {
        let name = format!("mesh_{}", self.files.len() + 1);
        let file = format!("{name}.obj");
        self.elements.push(("mesh", Attributes::of("name", &name).with("file", format!("{folder}/{file}"))));
        self.files.push((file, obj(mesh)));
        name
    }

    fn shared(&mut self, address: usize, keep: &Shape, folder: &str, mesh: impl FnOnce() -> TriMesh) -> String {
        if let Some(name) = self.names.get(&address) {
            return name.clone();
        }
        let name = self.add(&mesh(), folder);
        self.names.insert(address, name.clone());
        self.kept.push(keep.clone());
        name
    }
}

impl MjcfWriter<'_> {
    /// Writes a shape as one or several geoms. `pose` is that of the frame of its file in the body.
    pub(super) fn geoms(&mut self, owner: &str, pose: &Pose, shape: &Shape, common: &Attributes) {
        let round = |radius: f64, half: f64| numbers([radius, half]);
        let (kind, size) = match shape {
            Shape::Compound(compound) => {
                for part in compound.parts() {
                    self.geoms(owner, &(pose * part.pose), &part.shape, common);
                }
                return;
            }
            Shape::HalfSpace => ("plane", "0 0 1".to_owned()),
            Shape::Sphere { radius } => ("sphere", numbers([*radius])),
            Shape::Box { half_extents } => ("box", vector(half_extents)),
            Shape::Capsule { radius, half_length } => ("capsule", round(*radius, *half_length)),
            Shape::Cylinder(cylinder) => ("cylinder", round(cylinder.radius(), cylinder.half_length())),
            Shape::Ellipsoid { half_axes } => ("ellipsoid", vector(half_axes)),
            Shape::Mesh(mesh) => {
                let in_file = || mesh.mesh().clone().translated(&mesh.center_of_mass());
                let (address, folder) = (Arc::as_ptr(mesh).addr(), self.folder.clone());
                let name = self.assets.shared(address, shape, &folder, in_file);
                let volume = |mesh: &TriMesh| mesh.mass_properties(1.0).mass;
                let hull = mesh.mesh().convex_hull().map_or(f64::INFINITY, |hull| volume(&hull));
                if hull > (1.0 + 1e-6) * volume(mesh.mesh()) {
                    self.note(owner, "a mesh that is not convex collides by its convex hull in MuJoCo");
                }
                return self.mesh_geom(pose, &name, common);
            }
            Shape::Cone { .. } | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
                self.note(owner, format!("cones and rounded shapes are written as meshes with {SIDES} sides"));
                let folder = self.folder.clone();
                let name = self.assets.add(&shape.surface_mesh(SIDES), &folder);
                return self.mesh_geom(pose, &name, common);
            }
        };
        let mut geom = Attributes::of("type", kind).with("size", size);
        geom.put_pose(pose);
        self.xml.leaf("geom", &geom.joined(common));
    }

    fn mesh_geom(&mut self, pose: &Pose, name: &str, common: &Attributes) {
        let mut geom = Attributes::of("type", "mesh").with("mesh", name);
        geom.put_pose(pose);
        self.xml.leaf("geom", &geom.joined(common));
    }

    /// Returns the attributes of a part that collides: bits, friction, color. `look` is that of its visual, if it is drawn.
    pub(super) fn surface(
        &mut self,
        owner: &str,
        parts: &dyn Collidable,
        part: usize,
        collidable: bool,
        look: Option<&Appearance>,
    ) -> Attributes {
        let mut t = Attributes::default();
        if collidable && !parts.is_sensor(part) {
            let [kind, affinity] = self.groups.bits(kind_of(parts, part));
            t.put_unless(1, "contype", kind, kind.to_string());
            t.put_unless(1, "conaffinity", affinity, affinity.to_string());
            t = t.joined(&self.friction(owner, &parts.material(part)));
        } else {
            t = t.with("contype", "0").with("conaffinity", "0");
        }
        match look {
            Some(look) => t.joined(&self.color(owner, look)),
            None => t.with("group", HIDDEN),
        }
    }

    /// Returns the attributes of a part of a compound with a filter of its own, instead of those of the whole.
    pub(super) fn filtered(&mut self, owner: &str, filter: &ShapeFilter, whole: &Attributes) -> Attributes {
        let whole = whole.without(&["contype", "conaffinity"]);
        if filter.sensor {
            self.note(owner, "shapes that only report overlaps do not collide in MuJoCo, and report nothing");
            return whole.with("contype", "0").with("conaffinity", "0");
        }
        let [kind, affinity] = self.groups.bits((filter.group.bit(), filter.mask));
        let mut t = whole;
        t.put_unless(1, "contype", kind, kind.to_string());
        t.put_unless(1, "conaffinity", affinity, affinity.to_string());
        t
    }

    pub(super) fn friction(&mut self, owner: &str, material: &Material) -> Attributes {
        let plain = Material::default();
        let Material { friction, rolling_friction, torsional_friction, .. } = *material;
        let said = Material { friction, rolling_friction, torsional_friction, id: material.id, ..plain };
        if said != *material {
            self.note(
                owner,
                "restitution, static and directional friction, adhesion and surface velocity have no words in MJCF",
            );
        }
        let dimensions = match () {
            () if rolling_friction > 0.0 => "6",
            () if torsional_friction > 0.0 => "4",
            () if friction > 0.0 => "3",
            () => "1",
        };
        let mut t = Attributes::default();
        t.put_unless("3", "condim", dimensions, dimensions);
        t.put("friction", numbers([friction, torsional_friction, rolling_friction]));
        t
    }

    fn color(&mut self, owner: &str, look: &Appearance) -> Attributes {
        if look.shader != "plain" || look.texture.is_some() {
            self.note(owner, "patterns and textures are left out");
        }
        // the shortest decimal that reads back to the same single-precision number
        let color = look.color.map(|c| format!("{c:?}")).join(" ");
        Attributes::of("rgba", format!("{color} 1"))
    }

    /// Writes a visual that is no collider.
    pub(super) fn visual_geom(&mut self, owner: &str, visual: &Visual) {
        let mut common = Attributes::of("contype", "0").with("conaffinity", "0").with("group", DRAWN);
        common = common.joined(&self.color(owner, &visual.appearance));
        match &visual.geometry {
            VisualGeometry::Shape(shape) => {
                self.geoms(owner, &(visual.pose * about_frame(shape)), shape, &common);
            }
            VisualGeometry::Mesh(mesh) => match mesh.triangles() {
                Ok(triangles) => {
                    let folder = self.folder.clone();
                    let name = self.assets.add(triangles, &folder);
                    self.mesh_geom(&visual.pose, &name, &common);
                }
                Err(why) => self.note(owner, format!("visual mesh {} is left out: {why}", mesh.name())),
            },
        }
    }
}

impl Attributes {
    /// Returns these attributes, then the others.
    pub(super) fn joined(mut self, others: &Attributes) -> Attributes {
        self.extend(others);
        self
    }
}

/// Takes the visual of a collider out of a list, if it has one.
pub(super) fn visual_of<'v>(left: &mut Vec<&'v Visual>, shape: &Shape, pose: &Pose) -> Option<&'v Visual> {
    let drawn = left.iter().position(|visual| {
        matches!(&visual.geometry, VisualGeometry::Shape(s) if is_same(s, shape)) && visual.pose == *pose
    });
    drawn.map(|k| left.remove(k))
}

/// Returns the pose of a shape's own frame in the frame about its center of mass.
pub(super) fn about_frame(shape: &Shape) -> Pose {
    let back: Vec3 = -shape.center_of_mass();
    Pose::from_parts(back.into(), nalgebra::one())
}
