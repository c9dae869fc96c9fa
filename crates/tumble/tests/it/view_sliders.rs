//! Sliders of `tumble view`: real keys and mouse move the joints of a robot.

use crate::desktop::{Desktop, Session};
use serde_json::Value;

const ARM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/robot/arm.urdf");
/// Limits of the second joint in that file, rad.
const SHOULDER: [f64; 2] = [-1.92, 1.92];

fn joint(status: &Value, index: usize) -> (f64, Option<f64>, [f64; 3]) {
    let joint = &status["joints"][index];
    let pixels: [f64; 3] = std::array::from_fn(|k| joint["slider_px"][k].as_f64().unwrap());
    (joint["position"].as_f64().unwrap(), joint["target"].as_f64(), pixels)
}

/// The pixel of a slider at a fraction of its bar.
fn pixel([left, right, middle]: [f64; 3], share: f64) -> [u32; 2] {
    [(left + share * (right - left)).round() as u32, middle as u32]
}

/// Drags a slider from one fraction of its bar to another.
fn drag(view: &Session<'_>, bar: [f64; 3], from: f64, to: f64) {
    view.mouse(pixel(bar, from));
    view.button("mousedown", "1");
    view.mouse(pixel(bar, 0.5 * (from + to)));
    view.mouse(pixel(bar, to));
    view.button("mouseup", "1");
}

#[test]
fn sliders_set_positions_while_time_stands_and_targets_while_it_goes() {
    let Some(desktop) = Desktop::open() else { return };
    let args = [ARM, "--size", "480x320", "--quality", "fastest"];
    let Some(mut view) = Session::open(&desktop, "view-sliders", &args) else { return };
    let status = view.until("sliders", |s| s["joints"][1]["slider_px"].is_array());
    assert!(status["paused"] == true && status["joints"].as_array().unwrap().len() == 6, "{status}");
    let (start, target, bar) = joint(&status, 1);
    assert_eq!((start, target), (0.0, None));

    // while paused, the position is that of the mouse, to a pixel, and nothing else moves
    let [least, greatest] = SHOULDER;
    let a_pixel = (greatest - least) / (bar[1] - bar[0]);
    drag(&view, bar, -least / (greatest - least), 0.75);
    let wanted = least + 0.75 * (greatest - least);
    let status = view.until("the drag", |s| (joint(s, 1).0 - wanted).abs() <= a_pixel);
    assert!([0, 2, 3, 4, 5].iter().all(|k| joint(&status, *k).0 == 0.0) && status["frame"] == 0);
    assert_eq!(status["joints_held"], false);
    // the handle is drawn there: the three channels of its orange, in rows of 480 pixels
    let shot = view.shot();
    let [x, y] = pixel(bar, 0.75);
    let at = 3 * (480 * y + x) as usize;
    assert!(shot[at] > 240 && (140..180).contains(&shot[at + 1]) && shot[at + 2] < 80, "{:?}", &shot[at..at + 3]);

    // keys: the selected joint moves by a hundredth of its range
    let before = joint(&view.status().unwrap(), 1).0;
    view.key("bracketright");
    let step = 0.01 * (greatest - least);
    view.until("a key", |s| (joint(s, 1).0 - before - step).abs() < 1e-9);
    view.key("Tab");
    view.key("bracketleft");
    view.until("the next joint", |s| joint(s, 2).0 < 0.0);

    // drives hold the pose of the arm, except for its deflection by gravity
    view.key("k");
    let held = view.until("hold", |s| s["joints_held"] == true);
    view.key("space");
    let later = view.until("half a second", |s| s["time_s"].as_f64().unwrap() > held["time_s"].as_f64().unwrap() + 0.5);
    for k in 0..6 {
        let (position, target, _) = joint(&later, k);
        assert!((position - target.unwrap()).abs() < 0.05, "joint {k} is at {position}, not {target:?}");
    }

    // while running, the mouse sets the target, and the joint moves there
    let from = (joint(&later, 1).1.unwrap() - least) / (greatest - least);
    drag(&view, bar, from, 0.25);
    let wanted = least + 0.25 * (greatest - least);
    view.until("the target", |s| joint(s, 1).1.is_some_and(|target| (target - wanted).abs() <= a_pixel));
    view.until("the joint", |s| (joint(s, 1).0 - wanted).abs() < 0.05);

    // released, the arm falls; R resets to the start
    view.key("k");
    view.until("free", |s| s["joints_held"] == false && s["joints"][1]["target"].is_null());
    view.key("space");
    view.until("a pause", |s| s["paused"] == true);
    view.key("r");
    view.until("the start", |s| s["frame"] == 0 && (0..6).all(|k| joint(s, k).0 == 0.0));
    // J hides the panel
    view.key("j");
    view.until("no panel", |s| s["joints"][0]["slider_px"].is_null());
    view.key("Escape");
    assert_eq!(view.end().0, Some(0));
}

#[test]
fn the_sliders_of_a_scene_come_when_asked_for() {
    let Some(desktop) = Desktop::open() else { return };
    let args = ["robot", "--size", "480x320", "--quality", "fastest", "--paused"];
    let Some(mut view) = Session::open(&desktop, "view-scene-sliders", &args) else { return };
    assert!(view.status().unwrap()["joints"][0]["slider_px"].is_null());
    view.key("j");
    let status = view.until("sliders", |s| s["joints"][0]["slider_px"].is_array());
    // a drag on the panel picks no body
    let (_, _, bar) = joint(&status, 0);
    view.mouse(pixel(bar, 0.8));
    view.button("mousedown", "1");
    view.until("a slider", |s| joint(s, 0).0 != joint(&status, 0).0);
    assert!(view.status().unwrap()["picked"].is_null());
    view.button("mouseup", "1");
}
