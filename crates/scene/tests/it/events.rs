//! `[[template]]` and `[[event]]`: what is read, what is refused, the shipped scene, the example of the book.

use tumble_core::{ScriptedEvent, Template, World};
use tumble_scene::{SceneFile, resolve_scene};

const START: &str = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n[[template]]\nname = \"ball\"\nmax = 3\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1\n[[event]]\nname = \"e\"\n";

/// The errors of an event; its lines begin with line 12.
fn refused(event: &str) -> String {
    SceneFile::parse(&format!("{START}{event}\n"), "s.toml").unwrap_err().to_string()
}

#[test]
fn wrong_events_are_refused_with_line_and_column() {
    let spawn = "do = [{ spawn = \"ball\" }]";
    let cases = [
        (
            format!("when = {{ time_s = 0 }}\n{spawn}"),
            "s.toml:12:19: `time_s` of `when` of event \"e\" is 0; expected a number greater than 0",
        ),
        (
            format!("when = {{ }}\n{spawn}"),
            "s.toml:12:8: `when` of event \"e\" does not say when; expected one of `time_s`",
        ),
        (
            format!("when = {{ time_s = 1, key = \"k\" }}\n{spawn}"),
            "s.toml:12:8: `when` of event \"e\" has 2 conditions",
        ),
        (
            format!("when = {{ contact = [\"bal\", \"floor\"] }}\n{spawn}"),
            "s.toml:12:21: `contact` of `when` of event \"e\" is \"bal\"; did you mean `ball`?",
        ),
        (
            format!("when = {{ enters = \"floor\" }}\n{spawn}"),
            "s.toml:12:19: `enters` of `when` of event \"e\" is \"floor\"; expected the name of a body, or of an articulated body with a shape, that has `sensor = true`",
        ),
        (
            format!("when = {{ after = \"e\" }}\n{spawn}"),
            "s.toml:12:18: `after` of `when` of event \"e\" is \"e\"; expected the name of an event above this one; there is none",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ spawn = \"floor\" }]".into(),
            "s.toml:13:17: `spawn` of do 1 is \"floor\"; expected the name of a template",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ push = \"floor\" }]".into(),
            "s.toml:13:7: do 1 has no `impulse_n_s`; expected a list of 3 numbers",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ push = \"floor\", force_n = [0, 0, 1], duration_s = 1 }]".into(),
            "s.toml:13:35: `force_n` of do 1 is [0, 0, 1]; expected `impulse_n_s`, or `force = \"BODY\"` instead of `push`",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ remove = \"other\" }]".into(),
            "s.toml:13:18: `remove` of do 1 is \"other\"; expected the name of a body: `when` has no other one",
        ),
        (
            "when = { contact = \"floor\" }\ndo = [{ recolor = \"other\", color = \"#ffffff\" }]".into(),
            "s.toml:13:19: `recolor` of do 1 is \"other\"; expected a trigger that names the bodies",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ move_along = \"floor\", keyframes = [] }]".into(),
            "s.toml:13:22: `move_along` of do 1 is \"floor\"; expected the name of a body with mode = \"kinematic\"",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ light = 2, intensity = 1 }]".into(),
            "s.toml:13:17: `light` of do 1 is 2; expected an integer from 1 to 1",
        ),
        (
            "when = { time_s = 1 }\ndo = [{ drive = \"gears\", target = 1 }]\n[[body]]\nname = \"x\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1\n[[loop_joint]]\nname = \"gears\"\ntype = \"gear\"\na = \"floor\"\nb = \"x\"\nposition_m = [0, 0, 1]\naxis = [0, 0, 1]\nteeth = [1, 2]".into(),
            "s.toml:13:17: `drive` of do 1 is \"gears\"; expected the name of a loop joint, or \"OBJECT/LINK\", with a `drive` to a position or velocity",
        ),
        (
            format!("when = {{ asleep = 1 }}\n{spawn}"),
            "s.toml:12:19: `asleep` of `when` of event \"e\" is 1; expected the name of a body",
        ),
        ("when = { time_s = 1 }".into(), "s.toml:10:1: event \"e\" has no `do`"),
        ("when = { time_s = 1 }\ndo = [{ spwan = \"ball\" }]".into(), "s.toml:13:7: do 1 does not say what is done"),
    ];
    for (event, error) in cases {
        let said = refused(&event);
        assert!(said.starts_with(error), "{event}\n  {said}\n  {error}");
    }
    let many = START.replace("max = 3", "max = 10001");
    let error = SceneFile::parse(&many, "s.toml").unwrap_err().to_string();
    assert!(
        error.starts_with("s.toml:7:7: `max` of template \"ball\" is 10001; expected an integer from 1 to 10000"),
        "{error}"
    );
    let taken = format!("{START}when = {{ time_s = 1 }}\n{spawn}\n").replace("\"floor\"", "\"ball 2\"");
    let error = SceneFile::parse(&taken, "s.toml").unwrap_err().to_string();
    assert!(error.contains("there is a second body \"ball 2\""), "{error}");
}

#[test]
fn the_known_keys_of_events_are_in_the_reference() {
    let readme = include_str!("../../../../scenes/README.md");
    let q = "qqqqqqqqqqqq = 1";
    let texts = [
        format!("when = {{ time_s = 1, {q} }}"),
        format!("when = {{ every_s = 1, {q} }}"),
        format!("when = {{ contact = \"floor\", {q} }}"),
        format!("when = {{ time_s = 1 }}\n{q}"),
        format!("when = {{ time_s = 1 }}\ndo = [{{ spawn = \"ball\", {q} }}]"),
        format!("when = {{ time_s = 1 }}\ndo = [{{ push = \"floor\", impulse_n_s = [0, 0, 1], {q} }}]"),
        format!("when = {{ time_s = 1 }}\ndo = [{{ force = \"floor\", force_n = [0, 0, 1], duration_s = 1, {q} }}]"),
        format!("when = {{ time_s = 1 }}\ndo = [{{ light = 1, intensity = 1, {q} }}]"),
    ];
    let mut seen = 0;
    for text in texts {
        let error = SceneFile::parse(&format!("{START}{text}\n"), "s.toml").unwrap_err();
        let answer = error.problems().iter().find(|problem| problem.message.contains("qqqqqqqqqqqq")).unwrap();
        for key in answer.expected.split('`').skip(1).step_by(2) {
            assert!(readme.contains(key), "scenes/README.md does not name `{key}`");
            seen += 1;
        }
    }
    assert!(seen > 40, "{seen}");
}

fn fired(world: &World, event: &str) -> u64 {
    ScriptedEvent::fired(world, world.find(event).unwrap()).unwrap()
}

#[test]
fn the_ball_machine_keeps_its_timetable() {
    let scene = resolve_scene("ball_machine", &[]).unwrap().load().unwrap();
    let (mut world, _) = scene.build().unwrap();
    let tray = world.find("tray").unwrap();
    let mut first = None;
    let mut until = |world: &mut World, time: f64| {
        while world.time() < time - 1e-9 {
            world.step().unwrap();
            if fired(world, "through the ring") == 1 {
                first.get_or_insert(world.time());
            }
        }
    };
    until(&mut world, 3.49);
    assert_eq!((fired(&world, "throw"), fired(&world, "through the ring")), (5, 5));
    assert_eq!(world.looks().colors.len(), 5);
    let place = |world: &World| world.pose(tray, 0).unwrap().translation.vector;
    assert!((place(&world) - tumble_core::collide::Vec3::new(0.3, 0.0, 0.4)).norm() < 1e-9);
    until(&mut world, 5.0);
    assert!((place(&world) - tumble_core::collide::Vec3::new(0.3, 1.2, 0.7)).norm() < 1e-6);
    until(&mut world, 6.49);
    assert!((place(&world) - tumble_core::collide::Vec3::new(0.3, 0.0, 0.4)).norm() < 1e-2);
    assert_eq!(fired(&world, "throw"), 5);
    until(&mut world, 12.0);
    // enabled at 6.5 s, it makes up for what it missed, and goes on at 6.6, 7.0, 7.4 and 7.8 s
    assert_eq!((fired(&world, "throw"), fired(&world, "stop"), fired(&world, "carry")), (10, 2, 2));
    let first = first.unwrap();
    // 4/g after the throw, less the radius at 2 m/s
    assert!((first - (0.2 + 4.0 / 9.81 - 0.07 / 2.0)).abs() < 0.02, "{first}");
    assert!(world.press("b"));
}

#[test]
fn the_example_of_the_page_does_what_it_says() {
    let page = include_str!("../../../../docs/scripted_events.md");
    let text = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let (mut world, _) = SceneFile::parse(text, "page.toml").unwrap().build().unwrap();
    while world.time() < 2.6 {
        world.step().unwrap();
    }
    assert_eq!(fired(&world, "drop"), 2);
    assert_eq!(Template::counts(&world, world.find("ball").unwrap()), Some([2, 0]));
    // it falls 0.9 m with 1 kg and bounces with half: 6.3 N·s
    assert_eq!(fired(&world, "bounce"), 2);
    assert_eq!(world.looks().colors.len(), 2);
}
