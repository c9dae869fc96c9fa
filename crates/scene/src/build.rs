//! Builds a world from a scene: shapes, meshes, bodies, joints and pairs.

use std::path::PathBuf;

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use thiserror::Error;
use tumble_collide::{Pose, RepairSettings, Shape, ShapeError, TreeCache, TreeSettings, TriMesh, Vec3, decode_text};
use tumble_core::solver::SolverSettings;
use tumble_core::{
    Appearance, ArticulatedBody, LoopJoint, ObjectId, PairMaterial, PairSide, RigidBody, Settings, Sleep, Visual,
    World, WorldError,
};

use crate::appearance::AppearanceSpec;
use crate::articulated::ArticulatedSpec;
use crate::assemble;
use crate::body::{BodySpec, MassSpec};
use crate::collada;
use crate::file::SceneFile;
use crate::link_shapes::{self, Purpose, ShapeMaker};
use crate::loop_joint::{LoopJointKind, LoopJointSpec, PartSpec};
use crate::mesh::{MeshSource, MeshSpec};
use crate::pair::{PairSideSpec, PairSpec};
use crate::slow::building_surface;

/// Largest mesh file in bytes: 1 GiB.
pub(crate) const MAX_MESH_BYTES: u64 = 1 << 30;

/// Why a checked scene could not be built into a world.
#[derive(Debug, Error)]
pub enum BuildError {
    /// A mesh file could not be read.
    #[error("{scene}: mesh \"{mesh}\": cannot read {}: {source}", file.display())]
    MeshFile {
        /// The scene.
        scene: String,
        /// The mesh.
        mesh: String,
        /// Its file.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// A mesh is not a closed solid, or has invalid numbers.
    #[error("{scene}: mesh \"{mesh}\"{}: {why}", file.as_ref().map_or(String::new(), |f| format!(" ({})", f.display())))]
    Mesh {
        /// The scene.
        scene: String,
        /// The mesh.
        mesh: String,
        /// Its file, if it has one.
        file: Option<PathBuf>,
        /// From the reader or the check; names the line, the vertex or the triangle.
        why: String,
    },
    /// A body's shape or a constant of it is invalid.
    #[error("{scene}: body \"{body}\": {why}")]
    Body {
        /// The scene.
        scene: String,
        /// The body.
        body: String,
        /// From the shape or the body.
        why: String,
    },
    /// A shape or a constant of an articulated body is invalid.
    #[error("{scene}: articulated \"{body}\": {why}")]
    Articulated {
        /// The scene.
        scene: String,
        /// The body.
        body: String,
        /// From the shape or the body; names the link.
        why: String,
    },
    /// A loop joint is invalid.
    #[error("{scene}: {why}")]
    LoopJoint {
        /// The scene.
        scene: String,
        /// From the joint; names the joint.
        why: String,
    },
    /// The world refused a setting.
    #[error("{scene}: {source}")]
    World {
        /// The scene.
        scene: String,
        /// From the world.
        source: WorldError,
    },
}

/// Notes for the user: what was repaired or left out.
pub type Notes = Vec<String>;

impl SceneFile {
    /// Builds the world at time 0. Also returns notes about its meshes and robots. Sphere trees are
    /// taken from the cache that the environment names ([`TreeCache::of_environment`]) if it has
    /// them.
    ///
    /// # Errors
    /// [`BuildError`]: a mesh is unreadable or open, a body has no volume, a constant is invalid.
    pub fn build(&self) -> Result<(World, Notes), BuildError> {
        self.build_for(Purpose::Stepped)
    }

    /// Builds the same world for drawing only, as a cave facet needs it. Sphere trees and distance
    /// fields of meshes are built on first use, and overlaps of URDF links are not searched for.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_drawn(&self) -> Result<(World, Notes), BuildError> {
        self.build_for(Purpose::Drawn)
    }

    fn build_for(&self, purpose: Purpose) -> Result<(World, Notes), BuildError> {
        let mut notes = self.notes.clone();
        let world = |source| BuildError::World { scene: self.file.clone(), source };
        let meshes =
            self.meshes.iter().map(|mesh| self.solid(mesh, purpose, &mut notes)).collect::<Result<Vec<_>, _>>()?;
        let mut built = World::new(self.settings()).map_err(world)?;
        built.set_stepper(self.world.stepper.new_stepper());
        built.set_solver(self.world.solver.new_solver());
        for spec in &self.bodies {
            let body = self.body(spec, &meshes)?;
            let id = built.add_boxed(Box::new(body), spec.mode).map_err(|e| self.body_error(spec, e))?;
            built.set_collidable(id, spec.collides).map_err(world)?;
            built.set_enabled(id, spec.enabled).map_err(world)?;
        }
        let mut maker = ShapeMaker::new(&meshes, purpose);
        for spec in &self.articulated {
            self.add_articulated(spec, &mut maker, &mut built)?;
            let said = spec.notes.iter().cloned().chain(maker.notes.take());
            notes.extend(said.map(|note| format!("{}: articulated \"{}\": {note}", self.file, spec.name)));
        }
        for spec in &self.loop_joints {
            self.add_loop_joint(spec, &mut built)?;
        }
        for spec in &self.pairs {
            self.add_pair(spec, &mut built).map_err(world)?;
        }
        Ok((built, notes))
    }

    fn add_articulated(
        &self,
        spec: &ArticulatedSpec,
        maker: &mut ShapeMaker<'_>,
        world: &mut World,
    ) -> Result<(), BuildError> {
        let wrong = |why: String| BuildError::Articulated { scene: self.file.clone(), body: spec.name.clone(), why };
        let body = assemble::body(spec, maker).map_err(wrong)?;
        let id = world.add(body).map_err(|e| wrong(e.to_string()))?;
        world.set_enabled(id, spec.enabled).map_err(|e| wrong(e.to_string()))
    }

    fn add_loop_joint(&self, spec: &LoopJointSpec, world: &mut World) -> Result<(), BuildError> {
        let wrong = |why: String| BuildError::LoopJoint { scene: self.file.clone(), why };
        let (a, b) = (self.part(world, &spec.a), spec.b.and_then(|b| self.part(world, &b)));
        let (point, axis, name) = (Vec3::from(spec.position_m), Vec3::from(spec.axis), spec.name.as_str());
        let joint = match spec.kind {
            LoopJointKind::Spherical => LoopJoint::spherical_at(name, world, a, b, point),
            LoopJointKind::Revolute => LoopJoint::revolute_at(name, world, a, b, point, axis),
            LoopJointKind::Fixed => LoopJoint::fixed_at(name, world, a, b, point),
            LoopJointKind::Prismatic => LoopJoint::prismatic_at(name, world, a, b, point, axis),
        };
        world.add(joint.map_err(|e| wrong(e.to_string()))?).map(drop).map_err(|e| wrong(e.to_string()))
    }

    fn add_pair(&self, spec: &PairSpec, world: &mut World) -> Result<(), WorldError> {
        let [a, b] = spec.sides.map(|side| self.sides(world, side));
        let material = PairMaterial { restitution: spec.restitution, friction: spec.friction };
        for (a, b) in a.iter().flat_map(|a| b.iter().map(move |b| (*a, *b))) {
            world.set_pair_material(a, b, material)?;
        }
        Ok(())
    }

    /// Returns one side of a pair in the world: several parts for a link with several shapes.
    fn sides(&self, world: &World, side: PairSideSpec) -> Vec<PairSide> {
        let object = |name: &str| world.find(name).map(PairSide::Object).into_iter().collect();
        match side {
            PairSideSpec::Body(body) => object(&self.bodies[body].name),
            PairSideSpec::Articulated(spec) => object(&self.articulated[spec].name),
            PairSideSpec::Material(material) => vec![PairSide::Material(material_id(Some(material)))],
            PairSideSpec::Link(spec, link) => {
                let Some((id, link)) = self.part(world, &PartSpec::Link(spec, link)) else { return Vec::new() };
                let body = world.get::<ArticulatedBody>(id);
                body.into_iter().flat_map(|b| b.colliders_of(b.link_of(link))).map(|p| PairSide::Part(id, p)).collect()
            }
        }
    }

    /// Returns the object and part number of a part in the world.
    fn part(&self, world: &World, part: &PartSpec) -> Option<(ObjectId, usize)> {
        match *part {
            PartSpec::Body(body) => Some((world.find(&self.bodies[body].name)?, 0)),
            PartSpec::Link(spec, link) => {
                let spec = &self.articulated[spec];
                let id = world.find(&spec.name)?;
                let model = world.get::<ArticulatedBody>(id)?.model();
                let carrier = model.frame(&spec.links[link].name)?.link;
                Some((id, carrier.unwrap_or(model.links().len())))
            }
        }
    }

    fn settings(&self) -> Settings {
        let (w, base) = (&self.world, Settings::default());
        Settings {
            gravity: Vec3::from(w.gravity_m_per_s2),
            dt: w.dt_s,
            substeps: w.substeps,
            integrator: w.integrator.into(),
            integrator_tolerance: w.integrator_tolerance,
            solver_settings: SolverSettings { max_sweeps: w.iterations, ..base.solver_settings },
            contact_tolerance: w.contact_tolerance_m,
            drift_tolerance: base.drift_tolerance.max(w.contact_tolerance_m),
            sleep: w.sleep_after_s.map(|after| Sleep { after, within: w.sleep_within_m }),
            combine_friction: w.combine_friction,
            combine_restitution: w.combine_restitution,
            ..base
        }
    }

    /// Builds a mesh as a solid about its center of mass.
    fn solid(&self, spec: &MeshSpec, purpose: Purpose, notes: &mut Notes) -> Result<Shape, BuildError> {
        let file = match &spec.source {
            MeshSource::File { path, .. } => Some(path.clone()),
            _ => None,
        };
        let wrong = |why: String| BuildError::Mesh {
            scene: self.file.clone(),
            mesh: spec.name.clone(),
            file: file.clone(),
            why,
        };
        let (mut mesh, lines) = self.triangles(spec, &wrong)?;
        let mut mesh_notes = match spec.repair {
            true => make_solid(&mut mesh, &lines, Some(&RepairSettings::default())).map_err(&wrong)?,
            false => Vec::new(),
        };
        let mut settings = TreeSettings::octree();
        settings.depth = spec.sphere_tree_depth.unwrap_or(settings.depth);
        settings.error = spec.sphere_tree_max_error.unwrap_or(settings.error);
        let (called, count) = (spec.called(), mesh.triangles.len());
        let made = building_surface(&called, count, || purpose.mesh(mesh, &settings, &TreeCache::of_environment()));
        let (shape, note) = made.map_err(|error| match error {
            ShapeError::Mesh(error) if !spec.repair => wrong(error.at_line(&lines).to_string()),
            error => wrong(error.to_string()),
        })?;
        if let Shape::Mesh(solid) = &shape
            && !spec.repair
        {
            mesh_notes = solid.report().notes();
        }
        notes.extend(mesh_notes.into_iter().map(|note| format!("{}: mesh \"{}\": {note}", self.file, spec.name)));
        notes.extend(note.filter(|note| !notes.contains(note)));
        Ok(shape)
    }

    /// Returns the triangles of a mesh. For formats with lines, also the line of each triangle in
    /// the file.
    fn triangles(
        &self,
        spec: &MeshSpec,
        wrong: &impl Fn(String) -> BuildError,
    ) -> Result<(TriMesh, Vec<usize>), BuildError> {
        let made = match &spec.source {
            MeshSource::File { path, scale } => {
                let (mesh, lines) = self.read_mesh(spec, path, wrong)?;
                return Ok((mesh.scaled(*scale), lines));
            }
            MeshSource::Lathe { profile_m, segments } => {
                let profile: Vec<(f64, f64)> = profile_m.iter().map(|[r, z]| (*r, *z)).collect();
                TriMesh::lathe(&profile, *segments as usize).map_err(|e| wrong(e.to_string()))?
            }
            MeshSource::Torus { radius_m, tube_radius_m, segments, tube_segments } => {
                TriMesh::torus(*radius_m, *tube_radius_m, *segments as usize, *tube_segments as usize)
            }
            MeshSource::Icosphere { radius_m, subdivisions } => TriMesh::icosphere(*radius_m, *subdivisions),
            MeshSource::Cylinder { radius_m, length_m, segments } => {
                TriMesh::cylinder(*radius_m, 0.5 * length_m, *segments as usize)
            }
            MeshSource::Capsule { radius_m, length_m, segments } => {
                TriMesh::capsule(*radius_m, 0.5 * length_m, *segments as usize, (*segments as usize / 4).max(2))
            }
            MeshSource::Box { size_m } => TriMesh::box_(0.5 * Vec3::from(*size_m)),
        };
        Ok((made, Vec::new()))
    }

    fn read_mesh(
        &self,
        spec: &MeshSpec,
        path: &PathBuf,
        wrong: &impl Fn(String) -> BuildError,
    ) -> Result<(TriMesh, Vec<usize>), BuildError> {
        let unread = |source| BuildError::MeshFile {
            scene: self.file.clone(),
            mesh: spec.name.clone(),
            file: path.clone(),
            source,
        };
        let size = std::fs::metadata(path).map_err(unread)?.len();
        if size > MAX_MESH_BYTES {
            return Err(wrong(format!("the file has {size} bytes; the limit is {MAX_MESH_BYTES}")));
        }
        let bytes = std::fs::read(path).map_err(unread)?;
        read_with_lines(path, &bytes).map_err(wrong)
    }

    fn body(&self, spec: &BodySpec, meshes: &[Shape]) -> Result<RigidBody, BuildError> {
        let shape = link_shapes::make(&spec.shape, meshes).map_err(|e| self.body_error(spec, e))?;
        let body = match spec.mass {
            Some(MassSpec::Mass(mass)) => RigidBody::with_mass(&spec.name, shape.clone(), mass),
            Some(MassSpec::Density(density)) => RigidBody::with_density(&spec.name, shape.clone(), density),
            None => Ok(RigidBody::fixed(&spec.name, shape.clone())),
        };
        let [x, y, z, w] = spec.orientation_xyzw;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let pose = Pose::from_parts(Translation3::from(Vec3::from(spec.position_m)), rotation);
        let mut body = body
            .map_err(|e| self.body_error(spec, e))?
            .at(pose)
            .moving(Vec3::from(spec.velocity_m_per_s), Vec3::from(spec.angular_velocity_rad_per_s))
            .surface(spec.restitution, spec.friction)
            .of_material(material_id(spec.material))
            .colliding_by(spec.contacts)
            .drawn_as(visuals(spec, shape));
        if let Some(camera) = &spec.mounts.camera {
            body = body.with_camera(camera.clone());
        }
        if let Some(light) = &spec.mounts.light {
            body = body.with_light(light.clone());
        }
        body.linear_damping = spec.linear_damping_per_s;
        body.angular_damping = spec.angular_damping_per_s;
        Ok(body)
    }

    fn body_error(&self, spec: &BodySpec, why: impl ToString) -> BuildError {
        BuildError::Body { scene: self.file.clone(), body: spec.name.clone(), why: why.to_string() }
    }
}

/// Reads OBJ, STL, PLY or COLLADA, chosen by the file's extension, as a closed solid
/// ([`TriMesh::check_closed`]). With `repair` the mesh is repaired first ([`TriMesh::repair`]).
/// Also returns a note for each repair and each defect that a user should know.
///
/// # Errors
/// A sentence without the file's name. It names the first wrong triangle, and in an OBJ its line.
pub fn read_solid(
    path: &std::path::Path,
    bytes: &[u8],
    repair: Option<&RepairSettings>,
) -> Result<(TriMesh, Vec<String>), String> {
    let (mut mesh, lines) = read_with_lines(path, bytes)?;
    let notes = make_solid(&mut mesh, &lines, repair)?;
    Ok((mesh, notes))
}

fn make_solid(mesh: &mut TriMesh, lines: &[usize], repair: Option<&RepairSettings>) -> Result<Vec<String>, String> {
    let notes = match repair {
        Some(settings) => mesh.repair(settings).map(|report| report.notes()),
        None => mesh.check_closed().map(|report| report.notes()),
    };
    notes.map_err(|e| e.at_line(lines).to_string())
}

/// Reads OBJ, STL, PLY or COLLADA, chosen by the file's extension. The mesh need not be closed.
///
/// # Errors
/// A sentence without the file's name.
pub fn read_triangles(path: &std::path::Path, bytes: &[u8]) -> Result<TriMesh, String> {
    Ok(read_with_lines(path, bytes)?.0)
}

/// As [`read_triangles`], with the line of each triangle if the format has lines.
fn read_with_lines(path: &std::path::Path, bytes: &[u8]) -> Result<(TriMesh, Vec<usize>), String> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        "stl" => Ok((TriMesh::from_stl(bytes).map_err(|e| e.to_string())?, Vec::new())),
        "ply" => Ok((TriMesh::from_ply(bytes).map_err(|e| e.to_string())?, Vec::new())),
        "obj" => {
            let text = decode_text(bytes).map_err(|at| format!("byte {at} of the file is 0; an OBJ file is text"))?;
            TriMesh::from_obj_with_lines(&text).map_err(|e| e.to_string())
        }
        "dae" => {
            let text = std::str::from_utf8(bytes)
                .map_err(|e| format!("byte {} is not UTF-8; a COLLADA file is text", e.valid_up_to()))?;
            Ok((collada::read(text)?, Vec::new()))
        }
        other => Err(format!("the extension is '{other}'; supported are .obj, .stl, .ply and .dae")),
    }
}

/// Returns the world's id of a material; 0 for none.
pub(crate) fn material_id(material: Option<usize>) -> u32 {
    material.map_or(0, |index| index as u32 + 1)
}

fn visuals(spec: &BodySpec, shape: Shape) -> Vec<Visual> {
    if !spec.visible {
        return Vec::new();
    }
    let appearance = appearance(&spec.appearance, &shape.center_of_mass());
    vec![Visual::shape(0, Pose::identity(), shape, appearance)]
}

/// Converts an appearance to body axes, whose origin is the center of mass.
pub(crate) fn appearance(appearance: &AppearanceSpec, center: &Vec3) -> Appearance {
    let [r, g, b] = appearance.second_color;
    let named = [
        ("second_r", r),
        ("second_g", g),
        ("second_b", b),
        ("scale_m", appearance.pattern_scale_m),
        ("offset_m", appearance.pattern_offset_m - center.z),
        ("clearcoat", appearance.clearcoat),
    ];
    Appearance {
        color: appearance.color.map(|c| c as f32),
        roughness: appearance.roughness as f32,
        metallic: appearance.metallic as f32,
        shader: appearance.pattern.name().into(),
        properties: named.map(|(name, value)| (name.to_string(), value)).to_vec(),
        texture: appearance.texture.as_deref().map(Into::into),
        detail: appearance.detail,
    }
}
