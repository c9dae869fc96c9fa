//! Comparison with Pinocchio (the Python package `pin`), an independent implementation of the
//! dynamics, for the same trees in the same states: random trees of all joint kinds, and robots
//! from the Python package `example-robot-data`. Python is `$TUMBLE_PYTHON`, else `python3`.
//! Without the packages the tests print a note and pass.

#[path = "../../../core/tests/it/articulated_random.rs"]
#[allow(dead_code, reason = "shared with the tests of tumble-core")]
mod articulated_random;

use articulated_random::*;
use nalgebra::Quaternion;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use tumble_core::articulated::*;
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::{Joint, LinkMass, Model, ModelBuilder};

const GRAVITY: Vec3 = Vec3::new(0.3, -0.7, -9.81);
const STATES: usize = 4;

/// A state, and torques for the forward dynamics.
struct State {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    t: Vec<f64>,
}

#[test]
fn random_trees_move_as_pinocchio_says() {
    for (number, model) in random_trees(77).into_iter().enumerate() {
        if !agrees(&format!("random tree {number}, {} dof", model.dof()), &model) {
            return;
        }
    }
    for count in [7, 30] {
        let model = random_tree(&mut Random(count as u64), count, false, Kinds::Hinges);
        agrees(&format!("random tree of {count} hinges"), &model);
    }
}

#[test]
fn robots_move_as_pinocchio_says() {
    let Some(said) = python("robots", "") else { return };
    let mut robots: Vec<(String, Vec<&str>)> = Vec::new();
    for line in said.lines() {
        match line.split_once(' ') {
            Some(("robot", name)) => robots.push((name.to_string(), Vec::new())),
            Some(("link", rest)) => robots.last_mut().unwrap().1.push(rest),
            _ => panic!("{line}"),
        }
    }
    assert_eq!(robots.len(), 3);
    for (name, links) in robots {
        agrees(name.split_once(' ').unwrap().0, &read(&links));
    }
}

/// Returns whether Pinocchio is available; panics if the results differ by more than 1e-9.
fn agrees(name: &str, model: &Model) -> bool {
    let mut random = Random(model.dof() as u64);
    let states: Vec<State> = (0..STATES)
        .map(|_| {
            let (q, v) = random_state(&mut random, model, 2.0);
            State { q, v, a: random.numbers(model.dof(), 5.0), t: random.numbers(model.dof(), 20.0) }
        })
        .collect();
    let Some(said) = python("check", &question(model, &states)) else { return false };
    let mut worst = BTreeMap::new();
    let mut lines = said.lines();
    for state in &states {
        for (what, ours) in answers(model, state) {
            let (its_name, numbers) = lines.next().and_then(|l| l.split_once(' ')).unwrap();
            assert_eq!(its_name, what);
            let its: Vec<f64> = numbers.split(' ').map(|x| x.parse().unwrap()).collect();
            let error = relative(&ours, &its);
            assert!(error < 1e-9, "{name}: {what} differs by {error:e} of its greatest number");
            let most: &mut f64 = worst.entry(what).or_default();
            *most = most.max(error);
        }
    }
    println!(
        "{name}: {}",
        worst.iter().map(|(what, error)| format!("{what} {error:.1e}")).collect::<Vec<_>>().join(", ")
    );
    true
}

/// Returns our results, in the order and under the names of the script.
fn answers(model: &Model, state: &State) -> Vec<(&'static str, Vec<f64>)> {
    let dof = model.dof();
    let (mut kin, mut work) = (Kinematics::new(model), InverseDynamics::new(model));
    let (mut qdd, mut tau, mut mass) = (vec![f64::NAN; dof], vec![f64::NAN; dof], vec![f64::NAN; dof * dof]);
    forward_dynamics(&mut Dynamics::new(model), &GRAVITY, &state.q, &state.v, &state.t, &mut qdd).unwrap();
    inverse_dynamics(model, (&mut kin, &mut work), &GRAVITY, &state.q, &state.v, &state.a, &[], &mut tau);
    MassMatrix::new(model).write(model, &kin, &mut mass);
    let (e, p) = (energy(model, &kin, &GRAVITY), momentum(model, &kin));
    let (center, velocity) = center_of_mass(model, &kin).unwrap();
    let mut rates = vec![Rates::zero(); model.links().len()];
    kin.accelerations(model, &state.a, &Vec3::zeros(), &mut rates);
    let mut jacobian = vec![f64::NAN; 6 * dof];
    link_jacobian(model, &kin, model.links().len() - 1, &mut jacobian);
    let pair = |a: &Vec3, b: &Vec3| [a.data.0[0], b.data.0[0]].concat();
    vec![
        ("qdd", qdd),
        ("tau", tau),
        ("mass", mass),
        ("energy", vec![e.kinetic, e.potential]),
        ("center", pair(&center, &velocity)),
        ("momentum", pair(&p.linear, &p.angular)),
        ("accelerations", rates.iter().flat_map(|r| pair(&r.angular, &r.linear)).collect()),
        ("jacobian", jacobian),
    ]
}

/// Returns the tree and its states in the script's format.
fn question(model: &Model, states: &[State]) -> String {
    let mut text = String::new();
    line(&mut text, "gravity", GRAVITY.as_slice());
    for link in model.links() {
        let (kind, axis) = match link.joint {
            Joint::Fixed => unreachable!("folded"),
            Joint::Revolute { axis } => ("revolute", axis),
            Joint::Prismatic { axis } => ("prismatic", axis),
            Joint::Spherical => ("spherical", Vec3::zeros()),
            Joint::Floating => ("floating", Vec3::zeros()),
        };
        let parent = link.parent.map_or(-1, |p| p as i64);
        let (place, mass) = (&link.placement, &link.mass);
        let parts = [
            axis.as_slice(),
            place.translation.vector.as_slice(),
            place.rotation.coords.as_slice(),
            &[mass.mass],
            mass.center.as_slice(),
            mass.inertia.as_slice(),
        ];
        line(&mut text, &format!("link {parent} {kind}"), &parts.concat());
    }
    for state in states {
        for (name, numbers) in [("q", &state.q), ("v", &state.v), ("a", &state.a), ("t", &state.t)] {
            line(&mut text, name, numbers);
        }
        line(&mut text, "go", &[]);
    }
    text
}

fn line(text: &mut String, name: &str, numbers: &[f64]) {
    text.push_str(name);
    numbers.iter().for_each(|x| write!(text, " {x:?}").unwrap());
    text.push('\n');
}

/// Returns a tree from the script's format.
fn read(links: &[&str]) -> Model {
    let mut builder = ModelBuilder::new();
    for (number, link) in links.iter().enumerate() {
        let mut words = link.split(' ');
        let (parent, kind) = (words.next().unwrap().parse::<i64>().unwrap(), words.next().unwrap());
        let x: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
        let vector = |at: usize| Vec3::from_column_slice(&x[at..]);
        let joint = match kind {
            "revolute" => Joint::revolute(vector(0)),
            "prismatic" => Joint::prismatic(vector(0)),
            "spherical" => Joint::Spherical,
            "floating" => Joint::Floating,
            _ => panic!("{kind}"),
        };
        let place = Pose::from_parts(vector(3).into(), Quat::from_quaternion(Quaternion::new(x[9], x[6], x[7], x[8])));
        let mass = LinkMass { mass: x[10], center: vector(11), inertia: Mat3::from_column_slice(&x[14..]) };
        builder.link(format!("{number}"), usize::try_from(parent).ok(), joint, place, mass);
    }
    builder.build().unwrap()
}

/// Returns the output of the script, or reports that it cannot run and returns `None`.
fn python(mode: &str, input: &str) -> Option<String> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pinocchio_reference.py");
    let python = std::env::var("TUMBLE_PYTHON").unwrap_or_else(|_| "python3".into());
    let started = Command::new(&python)
        .arg(&script)
        .arg(mode)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = match started {
        Ok(child) => child,
        Err(error) => return skip(&format!("{python} does not run: {error}")),
    };
    // the script reads all of a tree before it answers, but it answers the first states while the
    // last are written: so a thread writes
    let (mut pipe, input) = (child.stdin.take()?, input.to_string());
    let writer = std::thread::spawn(move || pipe.write_all(input.as_bytes()).is_ok());
    let output = child.wait_with_output().unwrap();
    let wrote = writer.join().unwrap();
    let (said, complaint) =
        (String::from_utf8_lossy(&output.stdout).into_owned(), String::from_utf8_lossy(&output.stderr));
    match output.status.code() {
        Some(0) => {
            assert!(wrote);
            Some(said)
        }
        Some(77) => skip(said.trim()),
        _ => panic!("{said}{complaint}"),
    }
}

/// Prints a note to the terminal: the harness hides the `println!` output of a passing test.
fn skip(why: &str) -> Option<String> {
    let _ = writeln!(std::io::stderr(), "SKIPPED: comparison with Pinocchio: {why}");
    None
}
