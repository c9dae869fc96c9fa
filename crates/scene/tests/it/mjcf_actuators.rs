//! Actuators of MJCF: empty ranges. Numbers are those that the compiler of MuJoCo 4.0 makes.

use tumble_core::articulated::Drive;
use tumble_scene::mjcf::{MjcfOptions, parse};

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
