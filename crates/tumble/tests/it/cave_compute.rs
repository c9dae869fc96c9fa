//! Caves whose facets step the world by themselves: states, kills, wrong nodes, nodes that cannot.

use crate::cave_place::*;
use crate::common::json;
use rustix::process::Signal;

/// Runs a cave of two facets and returns its summary; both logs must have the same states.
fn everywhere(test: &str, carrier: &str) -> serde_json::Value {
    let place = Place::new(test, &wall());
    let args = [
        "--compute",
        "everywhere",
        "--transport",
        carrier,
        "--no-pictures",
        "--no-realtime",
        "--duration",
        "3",
        "--dt",
        "0.005",
        "--user-colliders",
        "--log-dir",
        &place.path("out"),
    ];
    let summary = place.succeed("cave", &args);
    let [left, right] = ["l", "r"].map(|facet| place.log("out", facet));
    // three steps of 5 ms in a frame
    assert_eq!(numbers(&left), (0..=200).collect::<Vec<_>>());
    assert!(states(&left) == states(&right));
    let mut different = states(&left);
    different.dedup();
    assert_eq!(different.len(), 201, "the world moves in each frame");
    for facet in summary["facets"].as_array().unwrap() {
        assert_eq!((&facet["mismatched"], &facet["first_difference"]), (&0.into(), &serde_json::Value::Null));
        let per_frame = facet["bytes_out"].as_u64().unwrap() / 201;
        assert!(per_frame < 2000, "{per_frame} bytes a frame over {carrier}");
    }
    place.assert_clean();
    summary
}

#[test]
fn every_node_steps_to_the_same_states_from_inputs_alone() {
    everywhere("compute-shm", "shared_memory");
}

#[test]
fn the_same_over_sealed_datagrams() {
    let summary = everywhere("compute-udp", "udp");
    assert_eq!(summary["transport"], "udp");
}

/// The cave file has the key too, and a facet that is killed gets the world when it is back.
#[test]
fn a_killed_node_catches_up_from_the_world_of_the_server() {
    let place = Place::new("compute-kill", &format!("{}compute = \"everywhere\"\n", wall()));
    let run = place.start(
        "cave",
        &["--no-pictures", "--log-dir", &place.path("out"), "--restart", "--summary", &place.path("summary.json")],
    );
    place.wait_for("out", "r", 5);
    signal(run.facet("r"), Signal::KILL);
    let at = *numbers(&place.log("out", "l")).last().unwrap();
    place.wait_for("out", "r", at + 60);
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    let left = place.log("out", "l");
    for line in place.log("out", "r") {
        assert_eq!(line["state"], left[line["frame"].as_u64().unwrap() as usize]["state"]);
    }
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[1]["joined"], &facets[1]["mismatched"]), (&2.into(), &0.into()));
}

/// A node with one wrong bit is named with frame and object, in a line, the summary and the exit code;
/// it is right again in the next frame, and a node that gets poses takes part in the same run.
#[test]
fn a_wrong_node_is_named_with_the_first_object_that_differs() {
    let place = Place::new("compute-wrong", &wall());
    let server = place.start(
        "serve",
        &["--compute", "everywhere", "--duration", "2", "--no-realtime", "--summary", &place.path("summary.json")],
    );
    let facet = |name: &str, more: &[&str]| {
        let args = ["--facet", name, "--no-pictures", "--log-dir", &place.path("out"), "--connect-timeout", "60"];
        place.start("facet", &[&args[..], more].concat())
    };
    let facets =
        [facet("l", &["--compute", "server"]), facet("r", &["--compute", "everywhere", "--disturb-after", "50"])];
    let (code, said, wrong) = server.end();
    assert_eq!(code, Some(1), "{wrong}");
    let expected = "facet r computed another state: 'ball' differs first, in frame 50";
    assert!(wrong.matches(expected).count() == 2, "a line at once, and the reason of the exit code: {wrong}");
    assert!(said.contains("DIFFERS from frame 50 in 'ball'"), "{said}");
    let summary = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!(summary[1]["first_difference"], serde_json::json!({"frame": 50, "object": "'ball'"}));
    assert_eq!((&summary[0]["mismatched"], &summary[1]["mismatched"]), (&0.into(), &1.into()));
    for facet in facets {
        let (code, _, wrong) = facet.end();
        assert_eq!(code, Some(0), "{wrong}");
    }
    for name in ["l", "r"] {
        assert_eq!(numbers(&place.log("out", name)), (0..=200).collect::<Vec<_>>(), "{name}");
    }
}

/// The inputs and the states of such a run are recorded as those of any other.
#[test]
fn nodes_with_other_steps_are_refused_and_a_replay_computes_nothing() {
    let place = Place::new("compute-refused", &wall());
    let server = place.start("serve", &["--compute", "everywhere"]);
    let args = ["--facet", "l", "--no-pictures", "--compute", "everywhere", "--connect-timeout", "60"];
    let (code, _, wrong) = place.start("facet", &[&args[..], &["--dt", "0.02"]].concat()).end();
    assert!(code == Some(2) && wrong.contains("has the hash"), "{code:?}: {wrong}");
    signal(server.pid(), Signal::TERM);
    assert_eq!(server.end().0, Some(0));
    let server = place.start("serve", &[]);
    let (code, _, wrong) = place.start("facet", &args).end();
    assert!(code == Some(2) && wrong.contains("start it with --compute everywhere"), "{code:?}: {wrong}");
    signal(server.pid(), Signal::TERM);
    assert_eq!(server.end().0, Some(0));
    let record = place.path("run.mcap");
    let args = ["--compute", "everywhere", "--no-pictures", "--no-realtime", "--duration", "0.2", "--record", &record];
    place.succeed("cave", &args);
    let summary = place.succeed("cave", &["--no-pictures", "--no-realtime", "--replay-input", &record]);
    assert_eq!((&summary["replay_input"]["same"], &summary["replay_input"]["different"]), (&21.into(), &0.into()));
}
