//! Geoms as shapes of bodies and links, and their collision groups.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use tumble_core::collide::{Pose, TriMesh, Vec3};
use tumble_core::{CollisionGroup, Material};

use super::Reader;
use super::asset::MeshFrom;
use super::geom::{Form, Geom};
use super::tree::Body;
use crate::parse::appearance::AppearanceSpec;
use crate::parse::link::{Geometry, LinkShape, Surface};
use crate::parse::material::MaterialSpec;
use crate::parse::mesh::{MeshSource, MeshSpec};
use crate::parse::pair::{PairSideSpec, PairSpec};
use crate::parse::shape::ShapeSpec;
use crate::urdf::MissingMeshes;
use crate::xml::Element;

/// Number of collision groups.
const GROUPS: usize = 64;

/// Names of the geoms that each geom meets by a `<pair>` alone, by its name.
pub(super) type Partners = BTreeMap<String, BTreeSet<String>>;

/// Index of the material of geoms with `condim="1"` in [`SceneFile::materials`](crate::SceneFile::materials).
const FRICTIONLESS: usize = 0;

/// Geoms that collide with the same others.
struct Kind {
    bits: [u32; 2],
    /// Names of the geoms that these meet by a `<pair>` alone.
    partners: BTreeSet<String>,
    /// Name of one of these geoms.
    name: Option<String>,
}

impl Kind {
    fn meets(&self, other: &Kind) -> bool {
        let paired = other.name.as_ref().is_some_and(|name| self.partners.contains(name));
        paired || do_bits_meet(self.bits, other.bits)
    }
}

/// Returns whether geoms with these `contype` and `conaffinity` collide.
pub(super) fn do_bits_meet(a: [u32; 2], b: [u32; 2]) -> bool {
    a[0] & b[1] != 0 || b[0] & a[1] != 0
}

/// Collision groups for the combinations of `contype`, `conaffinity` and pairs of a model.
pub(super) struct Groups {
    kinds: Vec<Kind>,
    partners: Partners,
    /// Whether there are geoms with `condim="1"` and a friction, and others.
    mixed: bool,
}

impl Groups {
    pub(super) fn of(bodies: &[Body<'_>], partners: Partners, root: &Element<'_, '_>, reader: &Reader<'_>) -> Groups {
        let paired = !partners.is_empty();
        let (mut groups, mut excess) = Groups::with_pairs(bodies, partners);
        if paired && excess.is_some() {
            let note =
                format!("pairs of geoms that their masks keep apart are left out: they need over {GROUPS} groups");
            reader.notes.add(root, note);
            (groups, excess) = Groups::with_pairs(bodies, Partners::new());
        }
        if let Some(geom) = excess {
            let message = "has one combination of `contype` and `conaffinity` too many";
            geom.element.problem(message, format!("expected at most {GROUPS} different combinations"));
        }
        groups
    }

    /// Returns the groups, and a geom that has none left.
    fn with_pairs<'b, 'a>(bodies: &'b [Body<'a>], partners: Partners) -> (Groups, Option<&'b Geom<'a>>) {
        let mut excess = None;
        let mut groups = Groups { kinds: Vec::new(), partners, mixed: false };
        let geoms = || bodies.iter().flat_map(|body| &body.geoms);
        for geom in geoms() {
            let alone = !geom.collides() && groups.partners_of(geom).is_none();
            if alone || groups.kind(geom).is_some() {
                continue;
            }
            let partners = groups.partners_of(geom).cloned().unwrap_or_default();
            groups.kinds.push(Kind { bits: geom.bits, partners, name: geom.name.clone() });
            if groups.kinds.len() == GROUPS + 1 {
                excess = Some(geom);
                break;
            }
        }
        let one = |geom: &Geom<'_>| geom.dimensions <= 1.0 && geom.friction[0] > 0.0;
        let colliding = || geoms().filter(|geom| groups.kind(geom).is_some());
        groups.mixed = colliding().any(one) && colliding().any(|geom| geom.dimensions > 1.0);
        (groups, excess)
    }

    fn partners_of(&self, geom: &Geom<'_>) -> Option<&BTreeSet<String>> {
        self.partners.get(geom.name.as_ref()?)
    }

    fn kind(&self, geom: &Geom<'_>) -> Option<usize> {
        let (none, own) = (BTreeSet::new(), self.partners_of(geom));
        self.kinds.iter().position(|kind| kind.bits == geom.bits && kind.partners == *own.unwrap_or(&none))
    }

    /// Returns the material of geoms with `condim="1"`, and the pair by which two of them have no friction, if the model
    /// has geoms of both kinds. MuJoCo takes the larger `condim` of a pair, and the larger friction.
    pub(super) fn frictionless(&self) -> Option<(MaterialSpec, PairSpec)> {
        let (contact, appearance) = (Material { friction: 0.0, ..Material::default() }, AppearanceSpec::default());
        let material = MaterialSpec { name: "frictionless".into(), contact, sound: None, appearance };
        let sides = [PairSideSpec::Material(FRICTIONLESS); 2];
        let pair = PairSpec { friction: Some(0.0), ..PairSpec::new(sides) };
        self.mixed.then_some((material, pair))
    }

    /// Returns the group of a geom and the groups that it collides with. Groups that the model does
    /// not use collide with all.
    pub(super) fn group(&self, geom: &Geom<'_>) -> (CollisionGroup, u64) {
        let Some(at) = self.kind(geom) else { return (CollisionGroup::default(), 0) };
        let unused = u64::MAX.checked_shl(self.kinds.len() as u32).unwrap_or(0);
        let mask = self.kinds.iter().take(GROUPS).enumerate().filter(|(_, other)| self.kinds[at].meets(other));
        let mask = mask.fold(unused, |mask, (k, _)| mask | 1 << k);
        (CollisionGroup::new(at as u8).unwrap_or_default(), mask)
    }

    /// Returns whether a geom collides with any geom of the model or of another object.
    pub(super) fn collides(&self, geom: &Geom<'_>) -> bool {
        let (_, mask) = self.group(geom);
        mask & !u64::MAX.checked_shl(self.kinds.len() as u32).unwrap_or(0) != 0
    }

    /// Returns the surface of a geom.
    pub(super) fn surface(&self, geom: &Geom<'_>) -> Surface {
        let (group, mask) = self.group(geom);
        let [sliding, torsional, rolling] = geom.friction;
        let material = (self.mixed && geom.dimensions <= 1.0).then_some(FRICTIONLESS);
        let contact = Material {
            friction: if geom.dimensions > 1.0 || material.is_some() { sliding } else { 0.0 },
            torsional_friction: if geom.dimensions > 3.0 { torsional } else { 0.0 },
            rolling_friction: if geom.dimensions > 4.0 { rolling } else { 0.0 },
            ..Material::default()
        };
        Surface { material, contact, group, mask, appearance: geom.appearance.clone(), ..Surface::default() }
    }
}

/// Meshes of rigid bodies, each once.
#[derive(Default)]
pub(super) struct Meshes {
    pub(super) specs: Vec<MeshSpec>,
    known: BTreeMap<String, usize>,
}

/// A shape of a geom, or its solid.
pub(super) enum Made {
    Primitive(ShapeSpec),
    /// A name and the solid in the frame of the geom.
    Solid(String, Arc<TriMesh>),
}

/// Returns the shape of a geom. `None` if it is left out, with a note or a problem.
pub(super) fn make(geom: &Geom<'_>, reader: &Reader<'_>) -> Option<Made> {
    Some(match &geom.form {
        Form::Plane => Made::Primitive(ShapeSpec::HalfSpace),
        Form::Sphere(radius_m) => Made::Primitive(ShapeSpec::Sphere { radius_m: *radius_m }),
        Form::Capsule(radius_m, half) => {
            Made::Primitive(ShapeSpec::Capsule { radius_m: *radius_m, length_m: 2.0 * half })
        }
        Form::Cylinder(radius_m, half) => {
            Made::Primitive(ShapeSpec::Cylinder { radius_m: *radius_m, length_m: 2.0 * half })
        }
        Form::Box(half) => Made::Primitive(ShapeSpec::Box { size_m: half.map(|x| 2.0 * x) }),
        Form::Ellipsoid(radii) => Made::Primitive(ShapeSpec::Ellipsoid { size_m: radii.map(|x| 2.0 * x) }),
        Form::Field(name) => Made::Solid(format!("hfield {name}"), reader.assets.fields.get(name)?.clone()),
        Form::Mesh(name) => match reader.solid(name) {
            Ok(mesh) => Made::Solid(name.clone(), mesh),
            Err(why) if reader.options.missing_meshes == MissingMeshes::Error && reader.files => {
                if let Some(mesh) = reader.assets.meshes.get(name) {
                    let expected = "expected an existing mesh with a volume; missing_meshes = \"skip\" leaves it out";
                    mesh.element.problem(format!("cannot be used for collision: {why}"), expected);
                }
                return None;
            }
            Err(why) => {
                reader.notes.add(&geom.element, format!("its mesh is left out: {why}"));
                return None;
            }
        },
    })
}

impl Meshes {
    /// Returns the shape of a body.
    pub(super) fn shape(&mut self, made: Made) -> ShapeSpec {
        let (name, mesh) = match made {
            Made::Primitive(shape) => return shape,
            Made::Solid(name, mesh) => (name, mesh),
        };
        let next = self.specs.len();
        let index = *self.known.entry(name.clone()).or_insert(next);
        if index == next {
            let source = MeshSource::Triangles { mesh };
            let (sphere_tree_depth, sphere_tree_max_error) = (None, None);
            self.specs.push(MeshSpec { name, source, repair: false, sphere_tree_depth, sphere_tree_max_error });
        }
        ShapeSpec::Mesh { mesh: index }
    }
}

/// Returns the shapes and visuals of a geom on a link; none if it is left out. `offset` is the pose
/// of the body in the frame of the link.
pub(super) fn on_link(geom: &Geom<'_>, groups: &Groups, reader: &Reader<'_>) -> Vec<LinkShape> {
    let collidable = groups.collides(geom);
    if !collidable && !geom.visible {
        return Vec::new();
    }
    let surface = groups.surface(geom);
    let part = |pose: Pose, geometry: Geometry, collidable: bool, visible: bool| LinkShape {
        pose,
        geometry,
        mass: None,
        surface: surface.clone(),
        collidable,
        visible,
        name: geom.name.clone().filter(|_| collidable),
        one_way: None,
        sensor: false,
    };
    let mut shapes = Vec::new();
    let mut visible = geom.visible;
    if let (Form::Mesh(name), true) = (&geom.form, geom.visible)
        && let Some(mesh) = reader.assets.meshes.get(name)
    {
        match &mesh.from {
            MeshFrom::File(path) => {
                let place = mesh.element.place();
                let file =
                    Geometry::File { path: path.clone(), scale: mesh.scale, place, hull: false, required: false };
                shapes.push(part(geom.pose * mesh.file_pose(), file, false, true));
                visible = false;
            }
            MeshFrom::Missing(why) if !collidable => {
                reader.notes.add(&mesh.element, format!("left out of the picture: {why}"));
                return shapes;
            }
            _ => {}
        }
    }
    if collidable || visible {
        let geometry = match make(geom, reader) {
            Some(Made::Primitive(ShapeSpec::HalfSpace)) | None => return shapes,
            Some(Made::Primitive(shape)) => Geometry::Shape(shape),
            Some(Made::Solid(name, mesh)) => Geometry::Solid { name, mesh },
        };
        shapes.push(part(geom.pose, geometry, collidable, visible));
    }
    shapes
}

/// Returns whether the normal of a plane at this pose points straight up.
pub(super) fn is_level(pose: &Pose) -> bool {
    (pose.rotation * Vec3::z()).z > 1.0 - 1e-12
}
