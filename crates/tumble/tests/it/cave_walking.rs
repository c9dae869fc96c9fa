//! Walking in a cave whose frames come slowly: users live in wall time.

use crate::cave_place::in_place;
use crate::cave_users::{Server, place};
use crate::common::{json, text};
use std::time::Duration;

/// Frames of 0.01 s that take 0.2 s each: 1.5 m/s by the wall clock are 0.3 m a frame, and by
/// simulated time 0.015 m.
#[test]
fn a_user_walks_by_wall_time_and_a_replay_walks_the_same_way() {
    let (folder, scene, cave) = place("cave-walk-slow");
    let (record, summary) = (text(&folder.path("run.mcap")), folder.path("summary.json"));
    let mut server = Server::start_in_real_time(&folder, &scene, &cave, &["--user-colliders", "--record", &record]);
    server.show_until(3, |_| {});
    let before = server.cave();
    server.show_until(15, |input| {
        input.keys = vec![0x1A];
        std::thread::sleep(Duration::from_millis(200));
    });
    let walked = (server.cave() - before).norm();
    // a busy machine is slower, and a frame counts for at most 20 times its length
    assert!((1.5..4.0).contains(&walked), "walked {walked} m");
    server.end();
    let fixed = ["cave", &scene, "--cave", &cave, "--no-realtime", "--no-pictures", "--user-colliders", "--quiet"];
    let more = ["--replay-input", &record, "--summary", &text(&summary)];
    let out = in_place(&folder, &[&fixed[..], &more].concat()).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let counts = json(&summary)["replay_input"].clone();
    assert!(counts["same"].as_u64() > Some(15) && counts["different"] == 0, "{counts}");
}
