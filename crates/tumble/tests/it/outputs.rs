//! Results of a run: the summary is complete and consistent, and the recording reads back and ends
//! at the state of `--save`.

use crate::common::*;
use serde_json::Value;
use tumble::net::record::read;

/// The keys that users may rely on.
const KEYS: [&str; 23] = [
    "scene",
    "stepper",
    "solver",
    "dt_s",
    "steps",
    "simulated_s",
    "wall_s",
    "real_time_factor",
    "contacts_mean",
    "contacts_max",
    "solver_residual_max_m_per_s",
    "unconverged_solves",
    "worst_solve",
    "rays",
    "max_penetration_m",
    "tries_mean",
    "tries_max",
    "floor_hits",
    "start",
    "end",
    "bodies",
    "start/kinetic_energy_j",
    "end/kinetic_energy_j",
];
const SUMS: [&str; 4] = ["kinetic_energy_j", "potential_energy_j", "linear_momentum_n_s", "angular_momentum_n_m_s"];

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap_or_else(|| panic!("{other} is no number"))],
    }
}

fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(&format!("/{pointer}")).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}

/// Cloth and jelly of the shipped scenes: their surfaces are recorded, but they are no entities.
const SOFT: [&str; 5] = ["banner", "sheet", "lower", "upper", "cushion"];

#[test]
fn every_shipped_scene_runs_and_leaves_a_whole_summary_and_a_recording_that_ends_where_it_ended() {
    let folder = Folder::new("outputs");
    for name in SCENES {
        let file = |kind: &str| text(&folder.path(&format!("{name}.{kind}")));
        let (summary, recording, saved) = (file("json"), file("mcap"), file("state"));
        let said = succeed(&[
            "run",
            name,
            "--duration",
            "0.25",
            "--summary",
            &summary,
            "--record",
            &recording,
            "--save",
            &saved,
            "--quiet",
        ]);
        assert_eq!(said, "", "{name}: quiet");
        let frames = check_summary(name, &json(summary.as_ref()), 0.25);
        check_recording(name, &recording, frames, &std::fs::read(&saved).unwrap(), &json(summary.as_ref()));
    }
}

/// Returns the number of frames.
fn check_summary(name: &str, summary: &Value, seconds: f64) -> usize {
    for key in KEYS {
        assert!(summary.pointer(&format!("/{key}")).is_some(), "{name}: no {key}");
    }
    for moment in ["start", "end"] {
        for sum in SUMS {
            assert!(numbers(&summary[moment][sum]).iter().all(|x| x.is_finite()), "{name}: {moment} {sum}");
        }
    }
    let (dt, steps) = (number(summary, "dt_s"), number(summary, "steps"));
    assert_eq!(steps, (seconds / dt).round(), "{name}: steps");
    assert!((number(summary, "simulated_s") - steps * dt).abs() < 1e-9, "{name}: simulated time");
    let factor = number(summary, "simulated_s") / number(summary, "wall_s");
    assert!((number(summary, "real_time_factor") / factor - 1.0).abs() < 1e-9, "{name}: real-time factor");
    assert!(number(summary, "contacts_mean") <= number(summary, "contacts_max"));
    for body in summary["bodies"].as_array().unwrap() {
        let norm: f64 = numbers(&body["orientation_xyzw"]).iter().map(|x| x * x).sum();
        assert!((norm - 1.0).abs() < 1e-9, "{name}: {} has a quaternion of norm² {norm}", body["name"]);
    }
    steps as usize
}

fn check_recording(name: &str, path: &str, frames: usize, saved: &[u8], summary: &Value) {
    let mut reader = read(path).unwrap();
    let all: Vec<_> = reader.by_ref().map(|frame| frame.unwrap()).collect();
    assert_eq!(all.len(), frames + 1, "{name}: a frame before the first step and one after each");
    assert!(all.iter().enumerate().all(|(i, frame)| frame.frame == i as u64), "{name}: frames are counted");
    let last = all.last().unwrap();
    assert!(last.state == saved, "{name}: the recording ends in another state than --save");
    assert!((last.time_s - number(summary, "simulated_s")).abs() < 1e-12);
    let is_soft = |body: &&Value| SOFT.iter().any(|soft| body["name"] == *soft);
    let bodies: Vec<_> = summary["bodies"].as_array().unwrap().iter().filter(|body| !is_soft(body)).collect();
    assert!(reader.entities().len() >= bodies.len(), "{name}");
    for body in bodies {
        let found = reader.entities().iter().zip(&last.poses).find(|(entity, _)| body["name"] == entity.name.as_str());
        let Some((entity, pose)) = found else {
            // an articulated body is recorded by its links
            let links = format!("{}/", body["name"].as_str().unwrap());
            assert!(
                reader.entities().iter().any(|entity| entity.name.starts_with(&links)),
                "{name}: {links} is not in the recording"
            );
            continue;
        };
        let summed = [numbers(&body["position_m"]), numbers(&body["orientation_xyzw"])].concat();
        // reading a decimal number back may cost its last bit
        let same = summed
            .iter()
            .zip(pose.position.iter().chain(&pose.rotation))
            .all(|(a, b)| (a - b).abs() <= 1e-14 * b.abs().max(1e-3));
        assert!(
            same && summed.len() == 7,
            "{name}: {} is at {pose:?} in the recording and at {summed:?} in the summary",
            entity.name
        );
    }
}

/// Energies and momenta from masses and poses, by hand.
#[test]
fn the_sums_of_the_summary_are_those_of_its_bodies() {
    let folder = Folder::new("sums");
    let path = folder.path("summary.json");
    // a sphere of 2 kg that flies for half a second: no contact, so the closed form holds
    let toml = "[world]\nduration_s = 0.5\ndt_s = 0.01\n[[body]]\nname = \"ball\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 2.0\n\
        position_m = [1.0, 2.0, 3.0]\nvelocity_m_per_s = [0.5, -0.25, 4.0]\nangular_velocity_rad_per_s = [0, 0, 3.0]\n";
    succeed(&["run", &folder.write("ball.toml", toml), "--quiet", "--summary", &text(&path)]);
    let summary = json(&path);
    let (m, g, t, spin) = (2.0, 9.81, 0.5, 0.4 * 2.0 * 0.01 * 3.0); // I = 2/5·m·r²
    let v = [0.5, -0.25, 4.0 - g * t];
    let x = [1.0 + 0.5 * t, 2.0 - 0.25 * t, 3.0 + 4.0 * t - 0.5 * g * t * t];
    let near = |what: &str, expected: f64, got: f64| {
        assert!((got - expected).abs() < 1e-9, "{what}: {got}, by hand {expected}")
    };
    (0..3).for_each(|k| near("position", x[k], numbers(&summary["bodies"][0]["position_m"])[k]));
    (0..3).for_each(|k| near("momentum", m * v[k], numbers(&summary["end"]["linear_momentum_n_s"])[k]));
    let cross = |k: usize| x[(k + 1) % 3] * v[(k + 2) % 3] - x[(k + 2) % 3] * v[(k + 1) % 3];
    let angular = [m * cross(0), m * cross(1), m * cross(2) + spin];
    (0..3).for_each(|k| near("angular momentum", angular[k], numbers(&summary["end"]["angular_momentum_n_m_s"])[k]));
    near(
        "kinetic",
        0.5 * m * v.iter().map(|v| v * v).sum::<f64>() + 0.5 * spin * 3.0,
        number(&summary, "end/kinetic_energy_j"),
    );
    near("potential", m * g * x[2], number(&summary, "end/potential_energy_j"));
    near("potential at the start", m * g * 3.0, number(&summary, "start/potential_energy_j"));
}

#[test]
fn check_passes_what_is_good_and_scenes_lists_what_is_shipped() {
    let mut args = vec!["check"];
    args.extend(SCENES);
    let said = succeed(&args);
    assert!(SCENES.iter().all(|name| said.contains(&format!("{name}: a scene of"))), "{said}");
    let listed = succeed(&["scenes"]);
    let mut names: Vec<_> = listed.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    names.sort();
    assert_eq!(names, SCENES);
    let folder = Folder::new("check");
    // a tetrahedron with three unit edges: volume 1/6, center of mass at a quarter of each
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let said = succeed(&["check", &folder.write("tetrahedron.obj", mesh)]);
    assert!(said.contains("volume 1.666667e-1 m³") && said.contains("(0.250000, 0.250000, 0.250000)"), "{said}");
    let robot = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"><inertial><mass value=\"2\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>\n\
                 <joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>";
    let said = succeed(&["check", &folder.write("robot.urdf", robot)]);
    assert!(
        said.contains("a robot of 2 links, 1 degrees of freedom on a fixed base, 2.000000 kg of moving mass"),
        "{said}"
    );
}

/// One line of text per file written, and a summary of the run, without `--quiet`.
#[test]
fn a_run_says_what_it_wrote() {
    let folder = Folder::new("says");
    let path = text(&folder.path("out.json"));
    let said = succeed(&["run", "incline", "--duration", "0.1", "--summary", &path]);
    assert!(said.contains(&path) && said.contains("times real time"), "{said}");
}

/// `--record` replaces a recording and an empty file, and nothing else.
#[test]
fn a_file_that_is_no_recording_is_not_overwritten() {
    let folder = Folder::new("run-record");
    let (mine, empty) = (folder.write("thesis.tex", "mine"), folder.write("run.mcap", ""));
    let run = |file: &str| ["run", "falling", "--quiet", "--duration", "0.02", "--record", file].map(str::to_owned);
    let said = fail(&run(&mine).each_ref().map(String::as_str), 2);
    assert!(said.contains("thesis.tex: is no recording of tumble and is not overwritten"), "{said}");
    assert_eq!(std::fs::read(&mine).unwrap(), b"mine");
    let said = fail(&run(&text(&folder.path("."))).each_ref().map(String::as_str), 2);
    assert!(said.contains("it is a folder"), "{said}");
    for _ in 0..2 {
        succeed(&run(&empty).each_ref().map(String::as_str));
        assert!(read(&empty).unwrap().next_frame().unwrap().is_some());
    }
}

/// Pictures of two runs are not mixed: a folder with pictures is refused, or they are removed.
#[test]
fn a_folder_with_pictures_of_an_earlier_run_is_refused() {
    let folder = Folder::new("run-mixed");
    let frames = folder.path("frames");
    std::fs::create_dir_all(&frames).unwrap();
    let [old, other, list] = ["frame_000090.png", "notes.txt", "frames.jsonl"].map(|name| frames.join(name));
    [&old, &other, &list].into_iter().for_each(|path| std::fs::write(path, "old").unwrap());
    let args = ["run", "falling", "--quiet", "--duration", "0.1", "--fps", "20", "--size", "32x24", "--frames-dir"];
    let args = [&args[..], &[frames.to_str().unwrap()]].concat();
    let out = tumble(&args);
    let said = String::from_utf8(out.stderr).unwrap();
    if said.contains("no picture:") {
        return; // no graphics adapter
    }
    assert!(out.status.code() == Some(2) && said.contains("is of an earlier run"), "{said}");
    assert!(old.exists());
    succeed(&[&args[..], &["--overwrite"]].concat());
    let mut names: Vec<String> =
        std::fs::read_dir(&frames).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["frame_000000.png", "frame_000001.png", "frame_000002.png", "notes.txt"]);
}
