//! Comparison with MuJoCo (the Python package `mujoco`) on models of the format MJCF: mass matrix,
//! bias forces, passive forces, forces of actuators and poses at random states. Python is
//! `$TUMBLE_PYTHON`, else `python3`. Without the package the tests print a note and pass.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::{DMatrix, DVector, Quaternion};
use tumble_core::articulated::{Drive, InverseDynamics, Kinematics, LinkMass, MassMatrix};
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::{ArticulatedBody, Joint, World};
use tumble_scene::mjcf::{MjcfError, MjcfOptions, load};
use tumble_scene::{MassSpec, SceneFile};

const STATES: usize = 5;
/// Largest relative difference.
const CLOSE: f64 = 1e-9;
/// The same for models of packages, whose mesh files have vertices in single precision.
const PACKAGES: f64 = 1e-7;

/// The output of the script.
struct Reference {
    joints: Vec<Vec<String>>,
    bodies: Vec<Vec<String>>,
    sites: Vec<Vec<String>>,
    actuators: Vec<String>,
    states: Vec<BTreeMap<String, Vec<f64>>>,
}

/// A joint of MuJoCo with its place in the scene.
struct Place<'s> {
    kind: usize,
    q: usize,
    v: usize,
    at: At<'s>,
}

enum At<'s> {
    Rigid(&'s tumble_scene::BodySpec),
    /// Articulated body, position number and velocity number.
    Joint(usize, usize, usize),
}

#[test]
fn models_of_the_tests_are_as_mujoco_reads_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf");
    for name in ["cartpole", "double_pendulum", "hopper", "humanoid", "quadruped", "joints", "frames", "scene"] {
        let close = CLOSE;
        if !compared(&folder.join(format!("{name}.xml")), close) {
            return;
        }
    }
}

#[test]
fn models_of_installed_packages_are_as_mujoco_reads_them_full_length() {
    let Some(Ok(listed)) = python(&["models"]) else { return };
    let (mut count, mut failed) = (0, Vec::new());
    // All of them take two minutes.
    let stride = if std::env::var("TUMBLE_SLOW").is_ok_and(|slow| slow == "1") { 1 } else { 8 };
    for path in listed.lines().step_by(stride).map(PathBuf::from) {
        match std::panic::catch_unwind(|| compared(&path, PACKAGES)) {
            Ok(compared) => count += usize::from(compared),
            Err(_) => failed.push(path),
        }
    }
    println!("{count} models compared");
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Compares a written model with MuJoCo. `None` without MuJoCo; the reason if MuJoCo refuses it.
pub(crate) fn compared_or_refused(path: &Path, close: f64) -> Option<Result<(), String>> {
    if let Err(refused) = python(&[&path.display().to_string(), "1"])? {
        return Some(Err(refused));
    }
    assert!(compared(path, close), "{}: it is not compared", path.display());
    Some(Ok(()))
}

/// Compares one model with MuJoCo. Returns whether MuJoCo is available and reads it.
fn compared(path: &Path, close: f64) -> bool {
    let Some(said) = python(&[&path.display().to_string(), &STATES.to_string()]) else { return false };
    let label = path.display().to_string();
    let scene = match (load(path, &MjcfOptions::default()), &said) {
        (Ok(scene), _) => scene,
        (Err(error), Err(refused)) => {
            println!("{label}: both refuse it: {refused} and {error}");
            return false;
        }
        (Err(error), Ok(_)) => {
            println!("{label}: refused: {error}");
            assert!(!matches!(error, MjcfError::Invalid(ref files) if files.iter().all(|f| f.problems.is_empty())));
            return false;
        }
    };
    let Ok(said) = said else { return false };
    let reference = Reference::read(&said);
    let (world, _) = scene.build().unwrap_or_else(|error| panic!("{label}: {error}"));
    let Some(places) = places(&scene, &world, &reference) else {
        println!("{label}: joints without names cannot be matched");
        return false;
    };
    // Forces that notes say are left out are not compared.
    let noted = |words: &[&str]| scene.notes.iter().any(|note| words.iter().any(|word| note.contains(word)));
    let mut left_out = Vec::new();
    if noted(&["of tendons", "springs of ball joints", "stiffness and armature of free", "tendons are left out"]) {
        left_out.push("passive");
    }
    if noted(&["armature of tendons", "stiffness and armature of free"]) {
        left_out.extend(["mass", "bias"]);
    }
    if noted(&["their forces follow the control at once"]) {
        left_out.extend(["actuation", "forces"]);
    }
    let mut worst: BTreeMap<&str, f64> = BTreeMap::new();
    for state in &reference.states {
        for (what, ours) in answers(&scene, &world, &places, &reference, state) {
            let theirs = &state[what];
            let size = theirs.iter().fold(1e-3f64, |m, x| m.max(x.abs()));
            assert_eq!(ours.len(), theirs.len(), "{label}: {what}");
            if left_out.contains(&what) {
                continue;
            }
            let error = ours.iter().zip(theirs).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / size;
            let most: &mut f64 = worst.entry(what).or_default();
            *most = most.max(error);
            assert!(error < close, "{label}: {what} differs by {error:e}\n{ours:?}\n{theirs:?}");
        }
    }
    let shown: Vec<String> = worst.iter().map(|(what, error)| format!("{what} {error:.1e}")).collect();
    println!("{label}: {}", shown.join(", "));
    true
}

impl Reference {
    fn read(said: &str) -> Reference {
        let mut made = Reference { joints: vec![], bodies: vec![], sites: vec![], actuators: vec![], states: vec![] };
        for line in said.lines() {
            let mut words = line.split(' ').map(str::to_owned);
            let (word, rest): (String, Vec<String>) = (words.next().unwrap(), words.collect());
            match word.as_str() {
                "joint" => made.joints.push(rest),
                "body" => made.bodies.push(rest),
                "site" => made.sites.push(rest),
                "actuator" => made.actuators.push(rest[0].clone()),
                _ => {
                    if word == "qpos" {
                        made.states.push(BTreeMap::new());
                    }
                    let numbers = rest.iter().map(|x| x.parse().unwrap()).collect();
                    made.states.last_mut().unwrap().insert(word, numbers);
                }
            }
        }
        made
    }
}

/// Finds the joints of MuJoCo in the scene: by name, else free bodies by the names of their bodies.
fn places<'s>(scene: &'s SceneFile, world: &World, reference: &Reference) -> Option<Vec<Place<'s>>> {
    let mut places = Vec::new();
    for row in &reference.joints {
        let [kind, q, v, body] = [2, 3, 4, 5].map(|k| row[k].parse::<usize>().unwrap());
        let plain = |name: &str| name.replace(' ', "_");
        let body = if row[1] == "-" { format!("body{body}") } else { row[1].clone() };
        let rigid = scene.bodies.iter().find(|spec| plain(&spec.name) == body && spec.mass.is_some());
        if let (0, Some(spec)) = (kind, rigid) {
            places.push(Place { kind, q, v, at: At::Rigid(spec) });
            continue;
        }
        let found = scene.articulated.iter().enumerate().find_map(|(number, spec)| {
            let named = |link: &&tumble_scene::LinkSpec| match row[0].as_str() {
                "-" => plain(&link.name) == body && link.joint.kind != Joint::Fixed,
                name => plain(&link.joint.name) == name && link.joint.kind != Joint::Fixed,
            };
            Some((number, spec.links.iter().find(named)?))
        });
        let (number, link) = found?;
        let model = world.get::<ArticulatedBody>(world.find(&scene.articulated[number].name)?)?.model();
        let moving = &model.links()[model.link(&link.name)?];
        places.push(Place { kind, q, v, at: At::Joint(number, moving.q, moving.v) });
    }
    Some(places)
}

/// Returns our numbers for a state of MuJoCo, under the names of the script.
fn answers(
    scene: &SceneFile,
    world: &World,
    places: &[Place<'_>],
    reference: &Reference,
    state: &BTreeMap<String, Vec<f64>>,
) -> Vec<(&'static str, Vec<f64>)> {
    let (qpos, qvel, ctrl) = (&state["qpos"], &state["qvel"], &state["ctrl"]);
    let n = qvel.len();
    let mut mass = DMatrix::<f64>::zeros(n, n);
    let (mut bias, mut passive) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
    let mut actuation = vec![0.0; n];
    let mut forces = vec![f64::NAN; reference.actuators.len()];
    let mut poses: BTreeMap<String, Pose> = BTreeMap::new();
    let gravity = Vec3::from(scene.world.gravity_m_per_s2);
    for (number, spec) in scene.articulated.iter().enumerate() {
        let body = world.get::<ArticulatedBody>(world.find(&spec.name).unwrap()).unwrap();
        let model = body.model();
        let dof = model.dof();
        // T takes MuJoCo's velocities to ours.
        let (mut q, mut t) = (vec![0.0; model.positions()], DMatrix::<f64>::zeros(dof, n));
        for place in places {
            let At::Joint(of, at, v) = place.at else { continue };
            if of != number {
                continue;
            }
            let theirs = &qpos[place.q..];
            match place.kind {
                0 => {
                    q[at..at + 3].copy_from_slice(&theirs[..3]);
                    q[at + 3..at + 7].copy_from_slice(rotation(&theirs[3..]).coords.as_slice());
                    let turn = rotation(&theirs[3..]).to_rotation_matrix().into_inner();
                    for i in 0..3 {
                        t[(v + 3 + i, place.v + i)] = 1.0;
                        (0..3).for_each(|k| t[(v + i, place.v + 3 + k)] = turn[(i, k)]);
                    }
                }
                1 => {
                    q[at..at + 4].copy_from_slice(rotation(theirs).coords.as_slice());
                    (0..3).for_each(|i| t[(v + i, place.v + i)] = 1.0);
                }
                _ => {
                    q[at] = theirs[0];
                    t[(v, place.v)] = 1.0;
                }
            }
        }
        let v = &t * DVector::from_column_slice(qvel);
        let (mut kin, mut work) = (Kinematics::new(model), InverseDynamics::new(model));
        let (mut own, mut tau) = (vec![0.0; dof * dof], vec![0.0; dof]);
        kin.refresh(model, &q, v.as_slice());
        MassMatrix::new(model).write(model, &kin, &mut own);
        mass += t.transpose() * DMatrix::from_vec(dof, dof, own) * &t;
        work.bias(model, &kin, &gravity, &[], &mut tau);
        bias += t.transpose() * DVector::from_vec(tau);
        let resisted: Vec<f64> = model
            .links()
            .iter()
            .flat_map(|link| {
                let q = &q;
                let v = &v;
                (0..link.joint.dof()).map(move |k| {
                    let dof = &body.dofs()[link.v + k];
                    let spring = dof.spring.map_or(0.0, |s| s.stiffness * (s.rest - q[link.q]));
                    spring - dof.damping * v[link.v + k]
                })
            })
            .collect();
        passive += t.transpose() * DVector::from_vec(resisted);
        for frame in model.frames() {
            poses.insert(frame.name.replace(' ', "_"), kin.frame_pose(frame));
        }
        for actuator in scene.actuators.iter().filter(|a| a.articulated == number) {
            let index = scene.actuators.iter().position(|a| std::ptr::eq(a, actuator)).unwrap();
            let theirs = match reference.actuators.len() == scene.actuators.len() {
                true => index,
                false => match reference.actuators.iter().position(|name| *name == actuator.name) {
                    Some(at) => at,
                    None => continue,
                },
            };
            let arms: Vec<(usize, usize, f64)> = actuator
                .moments
                .iter()
                .map(|(link, arm)| {
                    let link = &model.links()[model.link(&spec.links[*link].name).unwrap()];
                    (link.q, link.v, *arm)
                })
                .collect();
            let length = arms.iter().map(|(k, _, arm)| arm * q[*k]).sum();
            let rate = arms.iter().map(|(_, k, arm)| arm * v[*k]).sum();
            let force = actuator.force(length, rate, ctrl[theirs]);
            forces[theirs] = force;
            for (_, k, arm) in &arms {
                let column = (0..n).find(|c| t[(*k, *c)] == 1.0).unwrap();
                actuation[column] += arm * force;
            }
            check_drive(actuator, &arms, body, (length, rate), (&q, v.as_slice()), scene);
        }
    }
    for place in places {
        let At::Rigid(spec) = place.at else { continue };
        let turn = rotation(&qpos[place.q + 3..]);
        rigid(spec, place, &turn, qvel, &gravity, (&mut mass, &mut bias));
        let position = Vec3::from_column_slice(&qpos[place.q..place.q + 3]);
        poses.insert(spec.name.replace(' ', "_"), Pose::from_parts(position.into(), turn));
    }
    let (xpos, xquat) = (&state["xpos"], &state["xquat"]);
    let (mut positions, mut turns) = (xpos.clone(), xquat.clone());
    for (k, row) in reference.bodies.iter().enumerate() {
        let name = if row[0] == "-" { format!("body{k}") } else { row[0].clone() };
        // Bodies that are fixed to the world have no frame here.
        if let (Some(pose), true) = (poses.get(&name), row[1] != "0") {
            positions[3 * k..3 * k + 3].copy_from_slice(pose.translation.vector.as_slice());
            let [x, y, z, w] = pose.rotation.coords.into();
            let theirs = Quaternion::new(xquat[4 * k], xquat[4 * k + 1], xquat[4 * k + 2], xquat[4 * k + 3]);
            let sign = if Quaternion::new(w, x, y, z).dot(&theirs) < 0.0 { -1.0 } else { 1.0 };
            turns[4 * k..4 * k + 4].copy_from_slice(&[w, x, y, z].map(|c| sign * c));
        }
    }
    let mut sites = state["sites"].clone();
    for (k, row) in reference.sites.iter().enumerate() {
        if let (Some(pose), true) = (poses.get(&row[0]), reference.bodies.iter().all(|body| body[0] != row[0])) {
            sites[3 * k..3 * k + 3].copy_from_slice(pose.translation.vector.as_slice());
        }
    }
    let complete = forces.iter().all(|force| force.is_finite());
    let mut all = vec![
        ("mass", mass.as_slice().to_vec()),
        ("bias", bias.as_slice().to_vec()),
        ("passive", passive.as_slice().to_vec()),
        ("xpos", positions),
        ("xquat", turns),
        ("sites", sites),
    ];
    if complete {
        all.extend([("actuation", actuation), ("forces", forces)]);
    }
    all
}

/// Checks that the drive of a joint has the force of its only actuator, at the control of time 0.
fn check_drive(
    actuator: &tumble_scene::mjcf::ActuatorSpec,
    arms: &[(usize, usize, f64)],
    body: &ArticulatedBody,
    (length, rate): (f64, f64),
    (q, v): (&[f64], &[f64]),
    scene: &SceneFile,
) {
    let alike = |other: &&tumble_scene::mjcf::ActuatorSpec| {
        other.articulated == actuator.articulated && other.moments.iter().any(|(l, _)| *l == actuator.moments[0].0)
    };
    if !actuator.driven || scene.actuators.iter().filter(alike).count() > 1 {
        return;
    }
    let (k, dof, arm) = arms[0];
    let Drive::Position { stiffness, damping, target, velocity, limit } = body.dofs()[dof].drive else {
        panic!("no drive for {}", actuator.name)
    };
    let force = stiffness * (target - q[k]) + damping * (velocity - v[dof]);
    let expected = arm * actuator.force(length, rate, actuator.control);
    let clamped = force.max(-limit).min(limit);
    assert!((clamped - expected).abs() < 1e-9 * force.abs().max(1.0), "{}: {clamped} and {expected}", actuator.name);
}

/// Adds the mass matrix and the bias forces of a free rigid body.
fn rigid(
    spec: &tumble_scene::BodySpec,
    place: &Place<'_>,
    turn: &Quat,
    qvel: &[f64],
    gravity: &Vec3,
    (mass, bias): (&mut DMatrix<f64>, &mut DVector<f64>),
) {
    let Some(MassSpec::Mass(m)) = spec.mass else { panic!("{}", spec.name) };
    let (center, inertia) = (Vec3::from(spec.center_m.unwrap()), spec.inertia_kg_m2.unwrap());
    let r = turn.to_rotation_matrix().into_inner();
    let about = LinkMass { mass: m, center, inertia }.about_origin();
    let (c, spin) = (r * center, r * Vec3::from_column_slice(&qvel[place.v + 3..place.v + 6]));
    let coupling = -m * r * skew(&center);
    for i in 0..3 {
        mass[(place.v + i, place.v + i)] = m;
        for k in 0..3 {
            mass[(place.v + 3 + i, place.v + 3 + k)] = about[(i, k)];
            mass[(place.v + i, place.v + 3 + k)] = coupling[(i, k)];
            mass[(place.v + 3 + k, place.v + i)] = coupling[(i, k)];
        }
    }
    let weight = m * gravity * spec.gravity_scale;
    let force = m * spin.cross(&spin.cross(&c)) - m * gravity;
    let world = r * about * r.transpose();
    let torque = spin.cross(&(world * spin)) - c.cross(&(m * gravity));
    // MuJoCo counts compensated gravity as a passive force.
    let _ = weight;
    bias.rows_mut(place.v, 3).copy_from(&force);
    bias.rows_mut(place.v + 3, 3).copy_from(&(r.transpose() * torque));
}

fn skew(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

fn rotation(wxyz: &[f64]) -> Quat {
    Quat::from_quaternion(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]))
}

/// Returns the output of the script; the inner error is MuJoCo's for a model that it refuses. `None`,
/// with a note, if it cannot run.
pub(crate) fn python(arguments: &[&str]) -> Option<Result<String, String>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mujoco_reference.py");
    let python = std::env::var("TUMBLE_PYTHON").unwrap_or_else(|_| "python3".into());
    let output =
        match Command::new(&python).current_dir(env!("CARGO_TARGET_TMPDIR")).arg(&script).args(arguments).output() {
            Ok(output) => output,
            Err(error) => return skip(&format!("{python} does not run: {error}")),
        };
    let (said, complaint) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    match output.status.code() {
        Some(0) => Some(Ok(said.into_owned())),
        Some(77) => skip(said.trim()),
        Some(78) => Some(Err(said.trim().to_owned())),
        _ => panic!("{said}{complaint}"),
    }
}

/// Prints a note to the terminal: the harness hides the `println!` output of a passing test.
fn skip<T>(why: &str) -> Option<T> {
    let _ = writeln!(std::io::stderr(), "SKIPPED: comparison with MuJoCo: {why}");
    None
}
