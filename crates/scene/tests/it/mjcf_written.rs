//! Worlds written as MJCF: read back by the reader of this crate, and by MuJoCo where it is installed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use tumble_core::articulated::{InverseDynamics, Kinematics, MassMatrix};
use tumble_core::{ArticulatedBody, Joint, ObjectId, RigidBody, World};
use tumble_scene::mjcf::{MjcfOptions, MjcfWriter, load};
use tumble_scene::{LinkSpec, SceneFile, resolve_scene};

/// Largest difference, relative to the largest number.
const CLOSE: f64 = 1e-12;

/// A new folder for one test, removed when it goes out of scope.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble-written-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn moving(links: &[LinkSpec]) -> Vec<&LinkSpec> {
    links.iter().filter(|link| link.joint.kind != Joint::Fixed).collect()
}

/// The dynamics of a body by the names of its joints and their degrees of freedom.
struct Numbers {
    /// Name of each degree of freedom, its velocity number, its position and velocity.
    dofs: BTreeMap<String, (usize, f64, f64)>,
    mass: DMatrix<f64>,
    bias: DVector<f64>,
}

fn numbers(world: &World, id: ObjectId, links: &[LinkSpec]) -> Numbers {
    let body: &ArticulatedBody = world.get(id).unwrap();
    let (model, state) = (body.model(), world.state_of(id).unwrap());
    let (q, v) = state.split_at(model.positions());
    let mut kin = Kinematics::new(model);
    kin.refresh(model, q, v);
    let n = model.dof();
    let (mut mass, mut bias) = (vec![0.0; n * n], vec![0.0; n]);
    MassMatrix::new(model).write(model, &kin, &mut mass);
    InverseDynamics::new(model).bias(model, &kin, &world.settings().gravity, &[], &mut bias);
    let mut dofs = BTreeMap::new();
    for (link, spec) in model.links().iter().zip(moving(links)) {
        let single = link.joint.dof() == 1;
        for k in 0..link.joint.dof() {
            let position = if single { q[link.q] } else { f64::NAN };
            dofs.insert(format!("{} {k}", spec.joint.name), (link.v + k, position, v[link.v + k]));
        }
    }
    Numbers { dofs, mass: DMatrix::from_vec(n, n, mass), bias: DVector::from_vec(bias) }
}

/// Writes a world, reads it back at the keyframe `now` and compares all bodies. Returns the notes and the number of
/// articulated bodies.
fn compare(label: &str, scene: &SceneFile, world: &World, folder: &Path) -> (Vec<String>, usize) {
    let file = folder.join(format!("{label}.xml"));
    let notes = MjcfWriter::new(world).like(scene).save(&file).unwrap();
    let options = MjcfOptions { keyframe: Some("now".into()), ..MjcfOptions::default() };
    let read = load(&file, &options).unwrap_or_else(|error| panic!("{label}: {error}"));
    let (again, _) = read.build().unwrap_or_else(|error| panic!("{label}: {error}"));
    let mut bodies = 0;
    // a body with several roots is read back as several bodies
    let theirs: Vec<Numbers> =
        read.articulated.iter().map(|spec| numbers(&again, again.find(&spec.name).unwrap(), &spec.links)).collect();
    let mut taken = BTreeSet::new();
    for spec in &scene.articulated {
        let ours = numbers(world, world.find(&spec.name).unwrap(), &spec.links);
        bodies += usize::from(!ours.dofs.is_empty());
        // names that an earlier body has were numbered
        let mut written = BTreeMap::new();
        for link in moving(&spec.links) {
            let numbered = (2..).map(|k| format!("{}_{k}", link.joint.name));
            let mut names = std::iter::once(link.joint.name.clone()).chain(numbered);
            let name = names.find(|name| !taken.contains(name)).unwrap();
            taken.insert(name.clone());
            written.insert(link.joint.name.clone(), name);
        }
        let find = |name: &str| {
            let (joint, k) = name.rsplit_once(' ').unwrap();
            let name = format!("{} {k}", written[joint]);
            let found = theirs.iter().position(|body| body.dofs.contains_key(&name));
            let body = found.unwrap_or_else(|| panic!("{label}: there is no joint {name}"));
            (body, theirs[body].dofs[&name])
        };
        let [mass, bias] = [ours.mass.amax(), ours.bias.amax().max(1.0)];
        for (name, (a, position, velocity)) in &ours.dofs {
            let (body, (b, q, v)) = find(name);
            let same = |x: f64, y: f64| (x - y).abs() <= CLOSE * (1.0 + y.abs());
            assert!(position.is_nan() || same(*position, q), "{label}: {name} {position} {q}");
            assert!(same(*velocity, v), "{label}: {name} {velocity} {v}");
            let differs = (ours.bias[*a] - theirs[body].bias[b]).abs();
            assert!(differs <= CLOSE * bias, "{label}: bias of {name} differs by {differs:e} of {bias}");
            for (other, (c, ..)) in &ours.dofs {
                let (second, (d, ..)) = find(other);
                let coupled = if second == body { theirs[body].mass[(b, d)] } else { 0.0 };
                let differs = (ours.mass[(*a, *c)] - coupled).abs();
                assert!(differs <= CLOSE * mass, "{label}: mass of {name}, {other} differs by {differs:e} of {mass}");
            }
        }
    }
    for &id in world.ids() {
        let (Some(name), Some(body)) = (world.name(id), world.get::<RigidBody>(id)) else { continue };
        if world.status(id).unwrap().mode != tumble_core::Mode::Dynamic || !world.status(id).unwrap().enabled {
            continue;
        }
        let Some(other) = again.find(name) else { panic!("{label}: there is no {name}") };
        if let Some(theirs) = again.get::<RigidBody>(other) {
            assert!((body.mass() - theirs.mass()).abs() <= CLOSE * body.mass(), "{label}: {name}");
            assert!((body.inertia() - theirs.inertia()).amax() <= CLOSE * body.inertia().amax(), "{label}: {name}");
            let (a, b) = (world.center_state(id).unwrap(), again.center_state(other).unwrap());
            assert!((a.pose.translation.vector - b.pose.translation.vector).amax() <= 1e-11, "{label}: {name}");
            assert!((a.velocity - b.velocity).amax() <= 1e-11, "{label}: {name} {} {}", a.velocity, b.velocity);
            assert!((a.angular_velocity - b.angular_velocity).amax() <= 1e-11, "{label}: {name}");
        }
    }
    (notes, bodies)
}

/// Returns the models that are written: shipped scenes, and files of the tests.
fn sources() -> Vec<(String, SceneFile)> {
    let shipped = [
        "falling",
        "pendulum",
        "chain",
        "robot",
        "skeleton",
        "walker",
        "stack",
        "newtons_cradle",
        "steam_engine",
        "bird",
    ];
    let mut all: Vec<(String, SceneFile)> =
        shipped.iter().map(|name| ((*name).to_owned(), resolve_scene(name, &[]).unwrap().load().unwrap())).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf");
    for name in ["cartpole", "double_pendulum", "hopper", "humanoid", "quadruped", "joints", "frames", "scene"] {
        all.push((format!("mjcf_{name}"), load(folder.join(format!("{name}.xml")), &MjcfOptions::default()).unwrap()));
    }
    all
}

#[test]
fn what_is_written_is_read_back_with_equal_dynamics() {
    let folder = Folder::new("back");
    let mut bodies = 0;
    for (label, scene) in sources() {
        let (mut world, _) = scene.build().unwrap();
        for _ in 0..3 {
            world.step().unwrap_or_else(|error| panic!("{label}: {error}"));
        }
        let (notes, count) = compare(&label, &scene, &world, &folder.0);
        println!("{label}: {count} articulated bodies, {} notes", notes.len());
        bodies += count;
    }
    assert!(bodies >= 15, "{bodies}");
}

#[test]
fn what_is_written_is_read_by_mujoco_with_equal_dynamics() {
    let folder = Folder::new("mujoco");
    for (label, scene) in sources() {
        let (world, _) = scene.build().unwrap();
        let file = folder.0.join(format!("{label}.xml"));
        MjcfWriter::new(&world).like(&scene).save(&file).unwrap();
        match crate::mujoco::compared_or_refused(&file, 1e-9) {
            None => return, // MuJoCo is not installed, which is printed
            Some(Err(why)) => panic!("{label}: MuJoCo refuses it: {why}"),
            Some(Ok(())) => {}
        }
    }
}

#[test]
fn what_mjcf_cannot_say_is_noted() {
    let text = r#"
[world]
combine_friction = "product"
[[body]]
name = "floor"
mode = "static"
shape = { type = "half_space" }
[[body]]
name = "ball"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1
position_m = [0, 0, 1]
restitution = 0.5
linear_damping_per_s = 0.1
locked = ["rotation_x"]
[[body]]
name = "cone"
shape = { type = "cone", radius_m = 0.1, height_m = 0.2 }
mass_kg = 1
position_m = [1, 0, 1]
[[body]]
name = "away"
enabled = false
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1
position_m = [2, 0, 1]
[[articulated]]
name = "arm"
[[articulated.link]]
name = "upper"
joint = "revolute"
axis = [0, 1, 0]
shape = { type = "capsule", radius_m = 0.02, length_m = 0.3 }
mass_kg = 1
max_velocity_rad_per_s = 3
drive = { type = "velocity", target_rad_per_s = 1 }
[[loop_joint]]
name = "slide"
type = "cylindrical"
a = "ball"
b = "cone"
position_m = [0.5, 0, 1]
axis = [1, 0, 0]
"#;
    let scene = SceneFile::parse(text, "notes.toml").unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    let written = MjcfWriter::new(&world).like(&scene).text("files");
    let notes = written.notes.join("\n");
    for word in [
        "combines",
        "restitution",
        "linear_damping",
        "locked axes",
        "cones and rounded",
        "disabled",
        "velocity drives",
        "limits of velocities",
        "cylindrical",
    ] {
        assert!(notes.contains(word), "{word} is missing in\n{notes}");
    }
    assert_eq!(written.files.len(), 1, "the cone is a mesh");
    assert!(!written.text.contains("away"));
    let error = MjcfWriter::new(&world).save("model.txt").unwrap_err();
    assert_eq!(error.to_string(), "model.txt: expected the name of a .xml or .mjcf file");
}

/// Limits of one side, and equal ones, which hold a joint.
#[test]
fn limits_come_back() {
    let text = r#"
[[articulated]]
name = "arm"
[[articulated.link]]
name = "a"
joint = "revolute"
axis = [0, 1, 0]
limits_rad = [-0.5, 1.25]
mass_kg = 1
center_m = [0, 0, -0.5]
[[articulated.link]]
name = "b"
parent = "a"
position_m = [0, 0, -1]
joint = "prismatic"
axis = [0, 0, 1]
limits_m = [0.25, 0.25]
displacement_m = 0.25
mass_kg = 1
"#;
    let scene = SceneFile::parse(text, "limits.toml").unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    let written = MjcfWriter::new(&world).like(&scene).text("files");
    let read = tumble_scene::mjcf::parse(&written.text, "limits.xml", &MjcfOptions::default()).unwrap();
    let links = moving(&read.articulated[0].links);
    let limits: Vec<_> = links.iter().map(|link| link.joint.dof.limits).collect();
    assert_eq!(limits, [Some([-0.5, 1.25]), Some([0.25; 2])], "{}", written.text);
}

/// Filters of groups, excluded pairs and welds come back.
#[test]
fn contacts_and_constraints_come_back() {
    let text = r#"
[world]
combine_friction = "max"
[[body]]
name = "a"
shape = { type = "box", size_m = [0.1, 0.2, 0.3] }
mass_kg = 1
group = 1
mask = [0]
[[body]]
name = "b"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
position_m = [0.5, 0, 0]
friction = 0.25
[[body]]
name = "c"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2
position_m = [1, 0, 0]
[[loop_joint]]
name = "w"
type = "fixed"
a = "a"
b = "b"
position_m = [0.2, 0, 0]
[[loop_joint]]
name = "s"
type = "spherical"
a = "c"
position_m = [1, 0, 0.5]
[[pair]]
a = "b"
b = "c"
collides = false
"#;
    let scene = SceneFile::parse(text, "pairs.toml").unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    let written = MjcfWriter::new(&world).text("files");
    assert_eq!(written.notes, Vec::<String>::new());
    let read = tumble_scene::mjcf::parse(&written.text, "pairs.xml", &MjcfOptions::default()).unwrap();
    let (again, _) = read.build().unwrap();
    let body = |world: &World, name: &str| world.get::<RigidBody>(world.find(name).unwrap()).unwrap().clone();
    assert_eq!(body(&again, "b").material.friction, 0.25);
    for (one, other) in [("a", "a"), ("a", "b"), ("b", "c")] {
        let meets = |world: &World| {
            let (a, b) = (body(world, one), body(world, other));
            a.mask & b.group.bit() != 0 && b.mask & a.group.bit() != 0
        };
        assert_eq!(meets(&world), meets(&again), "{one} and {other}");
    }
    assert_eq!(read.loop_joints.len(), 2);
    assert_eq!(read.pairs.len(), 1);
}

/// The name of the model is taken by a folder: the meshes of an earlier model stay as they are.
#[test]
fn a_failure_leaves_an_earlier_model_and_its_meshes() {
    let text = |radius: f64| {
        format!(
            "[[body]]\nname = \"a\"\nmass_kg = 1\nshape = {{ type = \"cone\", radius_m = {radius}, height_m = 1 }}\n"
        )
    };
    let world = |radius| SceneFile::parse(&text(radius), "cone.toml").unwrap().build().unwrap().0;
    let folder = Folder::new("half");
    let file = folder.0.join("now.xml");
    MjcfWriter::new(&world(0.1)).save(&file).unwrap();
    let files = || {
        let mut files: Vec<_> =
            std::fs::read_dir(folder.0.join("now_files")).unwrap().map(|f| f.unwrap().path()).collect();
        files.sort();
        files.iter().map(|file| (file.clone(), std::fs::read(file).unwrap())).collect::<Vec<_>>()
    };
    let earlier = files();
    assert!(!earlier.is_empty());
    std::fs::rename(&file, folder.0.join("kept.xml")).unwrap();
    std::fs::create_dir_all(file.join("in the way")).unwrap();
    let error = MjcfWriter::new(&world(0.2)).save(&file).unwrap_err().to_string();
    assert!(error.starts_with(&format!("writing {}: ", file.display())), "{error}");
    assert_eq!(files(), earlier);
    let left: Vec<_> = std::fs::read_dir(&folder.0).unwrap().map(|f| f.unwrap().file_name()).collect();
    assert_eq!(left.len(), 3, "{left:?}");
    std::fs::remove_dir_all(&file).unwrap();
    MjcfWriter::new(&world(0.2)).save(&file).unwrap();
    assert_ne!(files(), earlier);
}
