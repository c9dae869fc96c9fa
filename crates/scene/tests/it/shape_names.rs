//! Names, surfaces and one-sided shapes of bodies and links: read from all formats, written and read back.

use crate::mjcf_written::Folder;
use tumble_core::collide::Vec3;
use tumble_core::{ArticulatedBody, Collidable, RigidBody, World};
use tumble_scene::mjcf::{MjcfOptions, MjcfWriter, articulation, load, parse};
use tumble_scene::urdf::{self, UrdfOptions};
use tumble_scene::{SceneFile, SceneWriter, sdformat};

const SCENE: &str = r#"
[materials.rubber]
friction = 0.9

[[body]]
name = "floor"
mode = "static"
shape = { type = "half_space", name = "surface" }

[[body]]
name = "sled"
mass_kg = 2
position_m = [0, 0, 3]
shape = { type = "compound", parts = [
  { type = "box", size_m = [1, 1, 0.1] },
  { type = "compound", parts = [{ type = "sphere", radius_m = 0.1, name = "left" }], position_m = [0, 0.5, 0] },
  { type = "sphere", radius_m = 0.1, name = "right", position_m = [0, -0.5, 0], friction = 0.1 },
] }

[[articulated]]
name = "arm"
position_m = [5, 0, 1]

[[articulated.link]]
name = "stand"
joint = "fixed"
shape = { type = "sphere", radius_m = 0.1, name = "pad" }
mass_kg = 1

[[articulated.link]]
name = "upper"
parent = "stand"
joint = "revolute"
axis = [0, 1, 0]
mass_kg = 1
material = "rubber"
shapes = [
  { type = "sphere", radius_m = 0.1, name = "pad", position_m = [1, 0, 0], one_way = [0.1, 0, 2] },
  { type = "compound", position_m = [1.5, 0.1, 0], parts = [
    { type = "sphere", radius_m = 0.1, name = "inner", friction = 0.2, position_m = [0, 0, 0.3] },
    { type = "sphere", radius_m = 0.1 },
  ] },
]

[[articulated.link]]
name = "hand"
parent = "upper"
position_m = [2, 0, 0]
joint = "fixed"
mass_kg = 1
shapes = [
  { type = "sphere", radius_m = 0.1, name = "pad" },
  { type = "compound", position_m = [0.5, 0, 0], parts = [{ type = "sphere", radius_m = 0.1, name = "tip", restitution = 0.5 }] },
]
"#;

fn build(text: &str) -> World {
    SceneFile::parse(text, "s.toml").unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap().0
}

/// Names of the shapes of a link by their numbers.
fn names<'b>(body: &'b ArticulatedBody, link: &str) -> Vec<&'b str> {
    body.shapes_of(body.model().frame_index(link).unwrap()).map(|(_, _, name)| name.unwrap_or("")).collect()
}

fn check(world: &World, also_surfaces: bool) {
    let sled = world.get::<RigidBody>(world.find("sled").unwrap()).unwrap();
    assert_eq!([0, 1, 2].map(|k| sled.shape_name(k)), [None, Some("left"), Some("right")]);
    assert_eq!(world.shape_name(world.find("floor").unwrap(), 0, 0), Some("surface"));
    let arm = world.get::<ArticulatedBody>(world.find("arm").unwrap()).unwrap();
    assert_eq!(names(arm, "stand"), ["pad"]);
    assert_eq!(names(arm, "upper"), ["pad", "inner", ""]);
    assert_eq!(names(arm, "hand"), ["pad", "tip"]);
    if also_surfaces {
        let constants = |link: &str, name: &str| {
            let (part, shape) = arm.shape_named(link, name).unwrap();
            let m = arm.shape_material(part, shape).unwrap();
            (m.friction, m.restitution, m.id)
        };
        assert_eq!(constants("upper", "inner"), (0.2, 0.0, 1));
        assert_eq!(constants("upper", "pad"), (0.9, 0.0, 1));
        assert_eq!(constants("hand", "tip"), (0.5, 0.5, 0));
        let (part, _) = arm.shape_named("upper", "pad").unwrap();
        let direction = Vec3::new(0.1, 0.0, 2.0).normalize();
        assert!((Collidable::one_way(arm, part).unwrap() - direction).norm() < 1e-15);
        assert_eq!(Collidable::one_way(arm, part + 1), None);
    }
}

#[test]
fn a_scene_keeps_names_and_surfaces_of_shapes_when_it_is_saved() {
    let folder = Folder::new("shape-names");
    let world = build(SCENE);
    check(&world, true);
    let path = folder.0.join("saved.toml");
    assert_eq!(SceneWriter::new(&world).save(&path).unwrap(), Vec::<String>::new());
    // the text is changed, so the world is built from it
    let text = std::fs::read_to_string(&path).unwrap() + "# edited\n";
    std::fs::write(&path, &text).unwrap();
    let (read, _) = SceneFile::load(&path).unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap();
    check(&read, true);
    let archived = World::from_archive(&read.archive(&[]).unwrap(), &mut |_| None).unwrap();
    check(&archived, true);
    assert!(text.contains("name = \"inner\"") && text.contains("one_way"), "{text}");
}

/// A hand that a fixed joint holds on the upper arm falls on a table. Its touch sensor and its name outlive saving.
#[test]
fn a_saved_scene_keeps_the_fixed_link_of_shapes_and_touch_sensors() {
    let folder = Folder::new("fixed-links");
    let text = SCENE.to_owned()
        + r#"
[[body]]
name = "table"
mode = "static"
shape = { type = "box", size_m = [0.6, 0.6, 0.2] }
position_m = [7.1, 0, 0.8]

[[sensor]]
name = "felt"
type = "touch"
on = "arm/hand"
position_m = [0, 0, 0.1]

[[sensor]]
name = "elbow"
type = "touch"
on = "arm/upper"
"#;
    let world = build(&text);
    let path = folder.0.join("saved.toml");
    assert_eq!(SceneWriter::new(&world).save(&path).unwrap(), Vec::<String>::new());
    let saved = std::fs::read_to_string(&path).unwrap() + "# edited\n";
    std::fs::write(&path, &saved).unwrap();
    let (read, _) = SceneFile::load(&path).unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap();
    let archived = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    for mut world in [world, read, archived] {
        let mut touched = false;
        for _ in 0..240 {
            world.step().unwrap();
            let felt = |name: &str| world.reading(world.find(name).unwrap()).unwrap()[0];
            let arm = world.find("arm").unwrap();
            let part = |c: &tumble_core::ContactPoint| if c.a == arm { c.part_a } else { c.part_b };
            let links: Vec<_> = world.contacts_of(arm).map(|c| world.part_name(arm, part(c)).unwrap()).collect();
            assert!(links.iter().all(|link| *link == "hand"), "{links:?}");
            assert_eq!(felt("elbow"), 0.0);
            touched |= felt("felt") > 0.0;
        }
        assert!(touched, "the hand did not reach the table");
    }
}

#[test]
fn wrong_names_are_errors_with_both_places() {
    let error = |from: &str, to: &str| {
        let text = SCENE.replace(from, to);
        assert_ne!(text, SCENE);
        SceneFile::parse(&text, "s.toml").unwrap_err().report(false)
    };
    let twice = error("\"right\"", "\"left\"");
    let wanted = "part 3 of the shape of body \"sled\" has the name \"left\" of part 2 of the shape of body \"sled\"";
    assert!(twice.contains("s.toml:17:3") && twice.contains(wanted), "{twice}");
    let twice = error("\"inner\"", "\"pad\"");
    assert!(twice.contains("shape 2 of link \"upper\" has the name \"pad\" of shape 1 of link \"upper\""), "{twice}");
    assert!(error("\"inner\"", "\"\"").contains("a name that is not empty"));
    let whole =
        error("{ type = \"compound\", position_m = [1.5", "{ type = \"compound\", name = \"x\", position_m = [1.5");
    assert!(whole.contains("no name for a compound, but one for each of its parts"), "{whole}");
    assert!(error("one_way = [0.1, 0, 2]", "one_way = [0, 0, 0]").contains("a direction, such as [0, 0, 1]"));
}

const LINKS: [&str; 2] = [
    r#"<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>"#,
    r#"<origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision>"#,
];

fn robot(second: &str) -> String {
    let [mass, sphere] = LINKS;
    format!(
        "<robot name=\"r\">\n<link name=\"base\"><collision name=\"pad\">{sphere}</link>\n<link name=\"arm\">{mass}\n\
         <collision name=\"pad\">{sphere}\n<collision name=\"\">{sphere}\n<collision name=\"{second}\">{sphere}\n\
         <visual name=\"pad\"><geometry><sphere radius=\"0.1\"/></geometry></visual></link>\n\
         <joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/></joint>\n</robot>"
    )
}

#[test]
fn urdf_and_sdf_have_names_of_collisions() {
    let folder = Folder::new("collision-names");
    let read = |second: &str| {
        let path = folder.0.join("r.urdf");
        std::fs::write(&path, robot(second)).unwrap();
        urdf::load(path, &UrdfOptions::default())
    };
    let (arm, _) = read("tip").unwrap();
    assert_eq!(names(&arm, "base"), ["pad"]);
    assert_eq!(names(&arm, "arm"), ["pad", "", "tip"]);
    let error = read("pad").err().unwrap().to_string();
    assert!(error.contains("r.urdf:6") && error.contains("r.urdf:4"), "{error}");
    let sdf = |second: &str| {
        let sphere = "<geometry><sphere><radius>0.1</radius></sphere></geometry></collision>";
        let text = format!(
            "<sdf version=\"1.9\"><model name=\"m\"><link name=\"l\">\n<collision name=\"one\">{sphere}\n\
             <collision name=\"{second}\"><pose>1 0 0 0 0 0</pose>{sphere}\n</link></model></sdf>"
        );
        sdformat::parse(&text, "m.sdf", &UrdfOptions::default())
    };
    let (world, _) = sdf("two").unwrap().build().unwrap();
    let body = world.get::<ArticulatedBody>(world.find("m").unwrap()).unwrap();
    assert_eq!(names(body, "l"), ["one", "two"]);
    let error = sdf("one").map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("m.sdf:3") && error.contains("the one at m.sdf:2"), "{error}");
}

const MODEL: &str = r#"<mujoco><worldbody>
<geom name="ground" type="plane" size="1 1 1"/>
<body name="free" pos="0 0 1"><freejoint/>
  <geom name="head" size="0.1"/><geom name="tail" size="0.1" pos="1 0 0"/><geom size="0.1" pos="2 0 0"/>
</body>
<body name="ball" pos="0 4 1"><freejoint/><geom name="skin" size="0.1"/></body>
<body name="arm" pos="4 0 1"><joint name="hinge" axis="0 1 0"/>
  <geom name="upper" size="0.1"/>
  <body name="hand" pos="1 0 0"><geom name="palm" size="0.1"/></body>
</body>
</worldbody></mujoco>"#;

#[test]
fn geoms_of_mujoco_have_their_names_and_are_written_with_them() {
    let check = |world: &World, on_arm: &[&str], on_hand: &[&str]| {
        let free = world.get::<RigidBody>(world.find("free").unwrap()).unwrap();
        assert_eq!([0, 1, 2].map(|k| free.shape_name(k)), [Some("head"), Some("tail"), None]);
        assert_eq!(world.shape_name(world.find("ball").unwrap(), 0, 0), Some("skin"));
        assert_eq!(world.shape_name(world.find("ground").unwrap(), 0, 0), Some("ground"));
        let arm = world.get::<ArticulatedBody>(world.find("arm").unwrap()).unwrap();
        assert_eq!((names(arm, "arm"), names(arm, "hand")), (on_arm.to_vec(), on_hand.to_vec()));
        assert!(arm.shape_named("arm", "upper").is_some());
    };
    let scene = parse(MODEL, "m.xml", &MjcfOptions::default()).unwrap();
    let (world, _) = scene.build().unwrap();
    check(&world, &["upper"], &["palm"]);
    let folder = Folder::new("geom-names");
    let path = folder.0.join("m.xml");
    MjcfWriter::new(&world).save(&path).unwrap();
    let (read, _) = load(&path, &MjcfOptions::default()).unwrap().build().unwrap();
    check(&read, &["upper"], &["palm"]);
    assert!(articulation(&path, &MjcfOptions::default()).is_ok());
    let twice = MODEL.replace("\"tail\"", "\"head\"");
    let error = parse(&twice, "m.xml", &MjcfOptions::default()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("m.xml:4:33: geom \"head\" has a name that is used before, at m.xml:4"), "{error}");
}
