//! Actuators of MJCF: defaults that all kinds share, and empty ranges. Numbers are those that the compiler of MuJoCo 4.0 makes.

use tumble_core::articulated::Drive;
use tumble_scene::SceneFile;
use tumble_scene::mjcf::{MjcfOptions, parse};

fn arm(defaults: &str, actuators: &str) -> Result<SceneFile, String> {
    let text = format!(
        r#"<mujoco><compiler angle="radian"/><default>{defaults}</default><worldbody>
        <body name="b"><joint name="j" axis="0 1 0" damping=".1" armature=".05"/>
        <geom type="box" size=".1 .05 .05" pos=".3 0 0"/></body></worldbody>
        <actuator>{actuators}</actuator></mujoco>"#
    );
    parse(&text, "m.xml", &MjcfOptions::default()).map_err(|error| error.to_string())
}

/// `actuator_gainprm[0]` and `actuator_biasprm[0..3]` of MuJoCo, of an actuator of the class that it names.
#[test]
fn kinds_of_actuators_share_their_defaults_as_in_mujoco() {
    let cases: &[(&str, &str, f64, [f64; 3])] = &[
        ("", "position", 1.0, [0.0, -1.0, 0.0]),
        ("", "velocity", 1.0, [0.0, 0.0, -1.0]),
        (r#"<general gainprm="50"/>"#, "position", 50.0, [0.0, -50.0, 0.0]),
        (r#"<general gainprm="50"/>"#, "velocity", 50.0, [0.0, 0.0, -50.0]),
        (r#"<general gainprm="50"/>"#, "motor", 1.0, [0.0; 3]),
        (r#"<general gainprm="50"/>"#, r#"position kv="2""#, 50.0, [0.0, -50.0, -2.0]),
        (r#"<position kp="50" kv="3"/>"#, "general", 50.0, [0.0, -50.0, -3.0]),
        (r#"<position kp="50" kv="3"/>"#, r#"general biasprm="4""#, 50.0, [4.0, -50.0, -3.0]),
        (r#"<position kp="50" kv="3"/>"#, r#"general gainprm="4""#, 4.0, [0.0, -50.0, -3.0]),
        (r#"<position kp="50" kv="3"/>"#, "velocity", 1.0, [0.0, 0.0, -1.0]),
        (r#"<position kp="50" kv="3"/>"#, r#"position kp="2""#, 2.0, [0.0, -2.0, -3.0]),
        (r#"<position kv="3"/>"#, "velocity", 1.0, [0.0, 0.0, -1.0]),
        (r#"<velocity kv="5"/>"#, "position", 1.0, [0.0, -1.0, 0.0]),
        (r#"<velocity kv="5"/>"#, "general", 5.0, [0.0, 0.0, -5.0]),
        (r#"<velocity kv="5"/>"#, "motor", 1.0, [0.0; 3]),
        (r#"<position kp="50" dampratio=".7"/>"#, "position", 50.0, [0.0, -50.0, -4.832873541348528]),
        (r#"<position kp="50" dampratio=".7"/>"#, r#"position kv="1""#, 50.0, [0.0, -50.0, -1.0]),
        (r#"<position kp="50" dampratio=".7"/>"#, "general", 50.0, [0.0, -50.0, -4.832873541348528]),
        (r#"<position kp="50" kv="3"/>"#, r#"position dampratio=".5""#, 50.0, [0.0, -50.0, -3.4520525295346633]),
        (r#"<general gainprm="50" biasprm="1 2 3"/>"#, "position", 50.0, [0.0, -50.0, -20.71231517720798]),
        (r#"<general gainprm="50" gaintype="affine"/>"#, "position", 1.0, [0.0, -1.0, 0.0]),
        (r#"<position kp="50" kv="3"/><velocity/>"#, "position", 1.0, [0.0, -1.0, 0.0]),
        (r#"<position kp="50" kv="3"/><general gear="1"/>"#, "velocity", 50.0, [0.0, 0.0, -50.0]),
        (r#"<velocity kv="5"/><general gear="1"/>"#, "position", 5.0, [0.0, -5.0, -5.0]),
        (r#"<intvelocity kp="4"/>"#, "position", 1.0, [0.0, -1.0, 0.0]),
        (
            r#"<position kp="50" kv="3"/><default class="c"><velocity/></default>"#,
            r#"position class="c""#,
            50.0,
            [0.0, -50.0, -3.0],
        ),
        (
            r#"<position kp="50" kv="3"/><default class="c"><velocity/></default>"#,
            r#"general class="c""#,
            1.0,
            [0.0, 0.0, -1.0],
        ),
        (
            r#"<general gainprm="50"/><default class="c"><position kv="2"/></default>"#,
            r#"velocity class="c""#,
            50.0,
            [0.0, 0.0, -50.0],
        ),
        (
            r#"<general gainprm="50"/><default class="c"><velocity/></default>"#,
            r#"velocity class="c""#,
            50.0,
            [0.0, 0.0, -50.0],
        ),
        (r#"<general gainprm="50"/><default class="c"/>"#, r#"position class="c""#, 50.0, [0.0, -50.0, 0.0]),
    ];
    for (defaults, actuator, gain, bias) in cases {
        let scene = arm(defaults, &format!(r#"<{actuator} joint="j"/>"#)).unwrap_or_else(|e| panic!("{defaults}: {e}"));
        let spec = &scene.actuators[0];
        let errors = [spec.gain - gain, spec.bias[0] - bias[0], spec.bias[1] - bias[1], spec.bias[2] - bias[2]];
        assert!(errors.iter().all(|e| e.abs() < 1e-12 * gain), "{defaults} {actuator}: {} {:?}", spec.gain, spec.bias);
    }
    // gear and ranges come from actuators of all kinds
    let scene = arm(r#"<motor gear="3" ctrlrange="-1 2"/>"#, r#"<position joint="j" kp="2"/>"#).unwrap();
    assert_eq!((scene.actuators[0].moments[0].1, scene.actuators[0].control_range), (3.0, Some([-1.0, 2.0])));
    let wrong = arm("", r#"<position joint="j" kv="2" dampratio="1"/>"#).unwrap_err();
    assert!(wrong.contains("has `kv` and `dampratio`"), "{wrong}");
}

/// MuJoCo limits nothing by a range of two equal numbers, unless a flag says so: `jnt_limited`, `jnt_actfrclimited`,
/// `actuator_ctrllimited` and `actuator_forcelimited` are 0.
#[test]
fn an_empty_range_limits_nothing() {
    let text = r#"<mujoco><default><joint range="-30 30" actuatorfrcrange="-1 1"/>
        <default class="free"><joint range="0 0" actuatorfrcrange="0 0"/></default></default>
        <worldbody><body name="b"><joint name="j" class="free" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/></body>
        <body name="c" pos="0 2 0"><joint type="ball" range="0 0"/><geom size=".1" pos=".3 0 0"/></body></worldbody>
        <actuator><position joint="j" kp="10" ctrlrange="0 0" forcerange="0 0"/></actuator>
        <keyframe><key name="k" qpos="0 1 0 0 0" ctrl="1"/></keyframe></mujoco>"#;
    let options = MjcfOptions { keyframe: Some("k".into()), ..MjcfOptions::default() };
    let scene = parse(text, "m.xml", &options).unwrap();
    let joint = |tree: usize| &scene.articulated[tree].links[0].joint;
    assert_eq!((joint(0).dof.limits, joint(0).dof.effort), (None, f64::INFINITY));
    assert_eq!((joint(1).cone, joint(1).twist_limits), (None, None));
    let spec = &scene.actuators[0];
    assert_eq!((spec.control, spec.control_range, spec.force_range), (1.0, None, None));
    let Drive::Position { target, limit, .. } = joint(0).dof.drive else { panic!("{:?}", joint(0).dof.drive) };
    assert_eq!((target, limit), (1.0, f64::INFINITY));
    assert_eq!(scene.notes.len(), 0, "{:?}", scene.notes);
    let one_sided = text.replace(r#"class="free" axis"#, r#"range="0 1" axis"#);
    let scene = parse(&one_sided, "m.xml", &options).unwrap();
    assert_eq!(scene.articulated[0].links[0].joint.dof.limits.map(|limits| limits[0]), Some(0.0));
}
