//! URDF: the meaning of its elements, and errors for wrong ones.

use std::path::{Path, PathBuf};

use tumble_core::articulated::DofSettings;
use tumble_core::collide::{Mat3, Shape, TriMesh, Vec3};
use tumble_core::{Drawn, Joint, Object};
use tumble_scene::urdf::{CollisionMeshes, MissingMeshes, UrdfModel, UrdfOptions, load, parse_model};

fn read(text: &str) -> UrdfModel {
    parse_model(text, "r.urdf", &UrdfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Reads `text` as `r.urdf` and compares all reported problems with `expected`, one line per
/// problem.
fn assert_errors(text: &str, expected: &[&str]) {
    let error = parse_model(text, "r.urdf", &UrdfOptions::default()).expect_err("the robot is wrong");
    let lines: Vec<String> = error.to_string().lines().map(str::to_owned).collect();
    assert_eq!(lines, expected, "for:\n{text}");
}

const BALL: &str = r#"<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>"#;

/// Returns two links and a joint between them, whose further elements are on line 4.
fn two(kind: &str, inside: &str) -> String {
    format!(
        "<robot name=\"two\">\n<link name=\"a\"/>\n<link name=\"b\">{BALL}</link>\n<joint name=\"j\" type=\"{kind}\"><parent link=\"a\"/><child link=\"b\"/>{inside}</joint>\n</robot>"
    )
}

const ARM: &str = r#"<?xml version="1.0"?>
<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro">
  <!-- the numbers are checked below -->
  <material name="red"><color rgba="0.8 0.1 0.1 1"/></material>
  <link name="base"/>
  <joint name="mount" type="fixed">
    <parent link="base"/><child link="plate"/><origin xyz="0 0 0.5"/>
  </joint>
  <link name="plate">
    <collision><geometry><box size="0.4 0.4 0.1"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="plate"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0 0 1.5707963267948966"/>
    <axis xyz="0 2 0"/>
    <limit lower="-1.5" upper="2" effort="40" velocity="3"/>
    <dynamics damping="0.25" friction="0.5"/>
  </joint>
  <link name="upper">
    <inertial><origin xyz="0 0 0.3" rpy="0 0 1.5707963267948966"/><mass value="3"/>
      <inertia ixx="0.1" iyy="0.02" izz="0.1" ixy="0.01" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 0.3"/><geometry><cylinder radius="0.05" length="0.6"/></geometry><material name="red"/></visual>
    <collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.06"/></geometry></collision>
    <collision><origin xyz="0 0 0.4"/><geometry><capsule radius="0.05" length="0.3"/></geometry></collision>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="rod"/><origin xyz="0 0 0.6"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.2" effort="10" velocity="1"/>
    <mimic joint="shoulder" multiplier="0.1" offset="0.05"/>
  </joint>
  <link name="rod"><inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.001"/></inertial></link>
  <joint name="tip_mount" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="0 0 0.2"/></joint>
  <link name="tip"><inertial><mass value="0.25"/><inertia ixx="0" iyy="0" izz="0"/></inertial></link>
  <joint name="wheel" type="continuous"><parent link="rod"/><child link="disc"/><axis xyz="1 0 0"/></joint>
  <link name="disc"><inertial><mass value="1"/><inertia ixx="0.02" iyy="0.01" izz="0.01"/></inertial></link>
  <gazebo reference="disc"><mu1>1</mu1></gazebo>
  <transmission name="t"><joint name="shoulder"/></transmission>
</robot>
"#;

#[test]
fn an_arm_means_what_it_says() {
    let arm = read(ARM);
    assert_eq!(
        (arm.name.as_str(), arm.joints.as_slice()),
        ("arm", ["shoulder", "slide", "wheel"].map(String::from).as_slice())
    );
    let [upper, rod, disc] = arm.model.links() else { panic!("three links move") };
    assert_eq!(upper.placement.translation.vector, Vec3::new(0.0, 0.0, 0.6), "through the fixed mount");
    assert!((upper.placement.rotation * Vec3::x() - Vec3::y()).norm() < 1e-15, "yaw of a quarter turn");
    assert_eq!(upper.joint, Joint::Revolute { axis: Vec3::y() });
    assert_eq!((upper.mass.mass, upper.mass.center), (3.0, Vec3::new(0.0, 0.0, 0.3)));
    // x and y of the inertial frame are y and −x of the link: xx and yy swap, and xy changes its
    // sign
    let inertia = Mat3::new(0.02, -0.01, 0.0, -0.01, 0.1, 0.0, 0.0, 0.0, 0.1);
    assert!((upper.mass.inertia - inertia).amax() < 1e-16);
    assert_eq!(rod.mass.mass, 0.75, "the tip is folded in");
    // 0.5·0.25/0.75·0.2² about the common center
    assert!((rod.mass.inertia[(0, 0)] - (0.01 + 0.5 * 0.25 / 0.75 * 0.04)).abs() < 1e-16);
    assert_eq!(disc.joint, Joint::Revolute { axis: Vec3::x() });
}

#[test]
fn an_arm_is_a_body_with_what_acts_on_it() {
    let folder = Folder::new("arm");
    let (body, notes) = load(folder.write("arm.urdf", ARM), &UrdfOptions::default()).unwrap();
    assert_eq!(notes, Vec::<String>::new());
    let [shoulder, slide, wheel] = body.dofs() else { panic!() };
    assert_eq!(
        *shoulder,
        DofSettings { limits: Some([-1.5, 2.0]), damping: 0.25, friction: 0.5, effort: 40.0, ..DofSettings::default() }
    );
    // the velocities in the file are enforced if asked
    let asked = UrdfOptions { velocity_limits: true, ..UrdfOptions::default() };
    let (limited, _) = load(folder.write("arm.urdf", ARM), &asked).unwrap();
    let velocities: Vec<f64> = limited.dofs().iter().map(|dof| dof.max_velocity).collect();
    assert_eq!(velocities, [3.0, 1.0, f64::INFINITY]);
    assert!(body.dofs().iter().all(|dof| dof.max_velocity.is_infinite()));
    assert_eq!(slide.limits, Some([0.0, 0.2]));
    assert_eq!(*wheel, DofSettings::default());
    let visuals = body.renderable().unwrap().visuals();
    assert_eq!(visuals.len(), 1);
    assert_eq!(visuals[0].appearance.color, [0.8, 0.1, 0.1]);
    // links, base, then colliders in the order of the file: plate, sphere, capsule
    let collidable = body.collidable().unwrap();
    assert_eq!(collidable.parts(), 3 + 1 + 3);
    let shapes: Vec<_> = (4..7).map(|part| collidable.shape(part).cloned()).collect();
    assert!(matches!(shapes[0], Some(Shape::Box { half_extents }) if half_extents == Vec3::new(0.2, 0.2, 0.05)));
    assert!(matches!(shapes[2], Some(Shape::Capsule { radius: 0.05, half_length: 0.15 })));
    assert_eq!(body.part_pose(6).translation.vector.z, 0.4);
}

#[test]
fn joints_of_several_dofs_are_stacks() {
    let planar = read(&two("planar", "<axis xyz=\"0 0 1\"/>"));
    assert_eq!(planar.joints, ["j/x", "j/y", "j"]);
    let [x, y, turn] = planar.model.links() else { panic!() };
    let (Joint::Prismatic { axis: x }, Joint::Prismatic { axis: y }) = (x.joint, y.joint) else { panic!() };
    assert!((x.cross(&y) - Vec3::z()).norm() < 1e-15, "a right-handed frame of the plane");
    assert_eq!(turn.joint, Joint::Revolute { axis: Vec3::z() });
    assert_eq!(read(&two("spherical", "")).model.links()[0].joint, Joint::Spherical);
    let floating = read(&two("floating", "<origin xyz=\"1 2 3\"/>"));
    assert_eq!(floating.model.links()[0].joint, Joint::Floating);
    assert_eq!(floating.model.links()[0].placement.translation.vector, Vec3::new(1.0, 2.0, 3.0));
    let root = parse_model(
        &two("continuous", "").replace("<link name=\"a\"/>", &format!("<link name=\"a\">{BALL}</link>")),
        "r.urdf",
        &UrdfOptions { floating: true, ..UrdfOptions::default() },
    );
    assert_eq!(root.unwrap().model.dof(), 7);
}

#[test]
fn a_floating_joint_on_a_link_that_moves_is_a_stack() {
    let text = two("continuous", "").replace("</robot>", &format!("<link name=\"c\">{BALL}</link><joint name=\"f\" type=\"floating\"><parent link=\"b\"/><child link=\"c\"/></joint></robot>"));
    let robot = read(&text);
    assert_eq!(robot.joints, ["j", "f/x", "f/y", "f/z", "f"]);
    assert_eq!(robot.model.dof(), 7);
}

#[test]
fn xml_that_is_not() {
    assert_errors(
        "<robot>\n<link name=\"a\">\n</robot>",
        &[
            "r.urdf:3:1: XML: expected 'link' tag, not 'robot'; expected a URDF: an XML document with one element <robot>",
        ],
    );
    assert_errors(
        "<robot>\n<link",
        &[
            "r.urdf:2:6: XML: the root node was opened but never closed; expected a URDF: an XML document with one element <robot>",
        ],
    );
    assert_errors(
        "",
        &[
            "r.urdf:1:1: XML: the document does not have a root node; expected a URDF: an XML document with one element <robot>",
        ],
    );
    assert_errors("<sdf/>", &["r.urdf:1:1: <sdf> is the outermost element; expected <robot>"]);
    assert_errors("<robot/>", &["r.urdf:1:1: <robot> has 0 links; expected 1 to 10000"]);
    assert_errors(
        "<!DOCTYPE r [<!ENTITY a \"b\">]><robot/>",
        &["r.urdf:1:1: XML: XML with DTD detected; expected a URDF: an XML document with one element <robot>"],
    );
}

#[test]
fn trees_that_are_none() {
    let joint = |name: &str, parent: &str, child: &str| {
        format!("<joint name=\"{name}\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>\n")
    };
    let robot = |links: &[&str], joints: &str| {
        let links: String = links.iter().map(|name| format!("<link name=\"{name}\">{BALL}</link>\n")).collect();
        format!("<robot>\n{links}{joints}</robot>")
    };
    assert_errors(
        &robot(&["a", "b"], &joint("j", "a", "c")),
        &["r.urdf:4:61: `link` of the child of joint \"j\" is \"c\"; expected the name of a link; did you mean \"a\"?"],
    );
    assert_errors(
        &robot(&["a", "b"], ""),
        &["r.urdf:3:1: links \"b\" and \"a\" are not children of any joint; expected one root link"],
    );
    assert_errors(
        &robot(&["a", "b", "c"], &(joint("j", "b", "c") + &joint("k", "c", "b"))),
        &["r.urdf:5:1: joint \"j\" is part of a loop of joints; expected a tree with one root"],
    );
    assert_errors(
        &robot(&["a", "b", "c"], &(joint("j", "a", "c") + &joint("k", "b", "c"))),
        &[
            "r.urdf:3:1: links \"b\" and \"a\" are not children of any joint; expected one root link",
            "r.urdf:6:1: joint \"k\" has the child \"c\", which is also the child of joint \"j\" at line 5; expected one joint for each link; a scene closes loops by [[loop_joint]]",
        ],
    );
    assert_errors(
        &robot(&["a", "a"], ""),
        &["r.urdf:3:1: there is a second link \"a\"; the first is at line 2; expected a unique name"],
    );
    assert_errors(
        &robot(&["a"], "<joint name=\"j\" type=\"hinge\"><parent link=\"a\"/></joint>"),
        &[
            "r.urdf:3:1: joint \"j\" has no <child>; expected <child link=\"NAME\"/>",
            "r.urdf:3:23: `type` of joint \"j\" is \"hinge\"; expected revolute, continuous, prismatic, fixed, floating, planar or spherical",
        ],
    );
}

#[test]
fn wrong_numbers() {
    assert_errors(
        &two("revolute", ""),
        &[
            "r.urdf:4:1: joint \"j\" has no <limit>; expected <limit lower upper effort velocity/>, or type=\"continuous\" for a revolute joint without limits",
        ],
    );
    assert_errors(
        &two("revolute", "<limit lower=\"1\" upper=\"-1\"/>"),
        &["r.urdf:4:82: `lower` of the limit of joint \"j\" is \"1\"; expected at most `upper`, -1"],
    );
    assert_errors(
        &two("continuous", "<axis xyz=\"0 0 0\"/>"),
        &["r.urdf:4:81: `xyz` of the axis of joint \"j\" is \"0 0 0\"; expected a direction: three numbers, not all 0"],
    );
    assert_errors(
        &two("continuous", "<origin xyz=\"0 nan 0\"/>"),
        &[
            "r.urdf:4:83: `xyz` of the origin of joint \"j\" is \"0 nan 0\"; expected 3 numbers separated by spaces; each a finite number from -1e12 to 1e12",
        ],
    );
    assert_errors(
        &two("continuous", "<origin rpy=\"0 0\"/>"),
        &[
            "r.urdf:4:83: `rpy` of the origin of joint \"j\" is \"0 0\"; expected 3 numbers separated by spaces; each a finite number from -1e12 to 1e12",
        ],
    );
    assert_errors(
        &two("continuous", "").replace("value=\"2\"", "value=\"-2\""),
        &["r.urdf:3:39: `value` of the mass of the inertial of link \"b\" is \"-2\"; expected a number of at least 0"],
    );
    assert_errors(
        &two("continuous", "").replace("iyy=\"1\"", "iyy=\"one\""),
        &[
            "r.urdf:3:65: `iyy` of the inertia of the inertial of link \"b\" is \"one\"; expected a finite number from -1e12 to 1e12",
        ],
    );
    assert_errors(
        &two("continuous", "<mimic joint=\"k\"/>"),
        &["r.urdf:4:70: joint \"j\" mimics \"k\"; expected the name of another joint"],
    );
    assert_errors(
        &two("continuous", "").replace(BALL, ""),
        &[
            "r.urdf:4:1: \"j\" moves link \"b\", and that link and its descendants have no mass; expected <inertial> in one of them, or a fixed joint",
        ],
    );
}

#[test]
fn an_inertia_of_no_body_is_corrected_with_a_note() {
    let robot =
        read(&two("continuous", "").replace("ixx=\"1\" iyy=\"1\" izz=\"1\"", "ixx=\"-0.5\" iyy=\"1\" izz=\"1\""));
    assert_eq!(robot.notes.len(), 1);
    assert_eq!(
        robot.notes[0],
        "r.urdf:3: the inertia of the inertial of link \"b\": negative principal moments are set to 0"
    );
    assert!((robot.model.links()[0].mass.inertia - Mat3::from_diagonal(&Vec3::new(0.0, 1.0, 1.0))).amax() < 1e-15);
}

/// A folder for one test, removed when it goes out of scope.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble-urdf-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Returns a mesh as the text of an OBJ file, without its last `without` triangles.
fn obj(mesh: &TriMesh, without: usize) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles[..mesh.triangles.len() - without]
        .iter()
        .map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    vertices.chain(faces).collect()
}

/// A chain of spheres 0.1 m apart on a fixed base, with radii that overlap their second neighbors.
#[test]
fn neighbors_and_links_that_overlap_at_the_start_never_collide() {
    let link = |name: &str, radius: f64| {
        format!(
            "<link name=\"{name}\">{BALL}<collision><geometry><sphere radius=\"{radius}\"/></geometry></collision></link>\n"
        )
    };
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0.1 0 0\"/></joint>\n"
        )
    };
    let text = format!(
        "<robot name=\"r\">\n{}{}{}{}{}{}{}{}</robot>",
        link("base", 0.04),
        link("a", 0.04),
        link("b", 0.12),
        link("c", 0.04),
        link("d", 0.09),
        joint("j", "continuous", "base", "a") + &joint("k", "planar", "a", "b"),
        joint("l", "continuous", "b", "c"),
        joint("m", "continuous", "c", "d"),
    );
    let folder = Folder::new("overlap");
    let (body, notes) =
        load(folder.write("r.urdf", &text), &UrdfOptions { floating: true, ..UrdfOptions::default() }).unwrap();
    let first = body.model().links().len() + 1;
    let collidable = body.collidable().unwrap();
    let meet = |a: usize, b: usize| collidable.parts_collide(first + a, first + b);
    // 0.2 m between second neighbors: b reaches 0.12 and d 0.09, the others 0.04
    assert!(!meet(0, 1) && !meet(1, 2) && !meet(2, 3) && !meet(3, 4), "joined, one pair through a stack");
    assert!(!meet(2, 4), "overlap");
    assert!(meet(0, 2) && meet(0, 3) && meet(1, 3) && meet(1, 4));
    assert_eq!(notes, ["links that overlap at the start do not collide: b and d"]);
}

/// Returns one link with a collision mesh and a visual mesh.
fn with_meshes(collision: &str, scale: &str, visual: &str) -> String {
    format!(
        "<robot name=\"r\"><link name=\"a\"/><joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint>\n<link name=\"b\">{BALL}<collision><geometry><mesh filename=\"{collision}\" scale=\"{scale}\"/></geometry></collision>\n<visual><geometry><mesh filename=\"{visual}\"/></geometry></visual></link></robot>"
    )
}

#[test]
fn meshes_are_found_by_package_path_and_uri() {
    let folder = Folder::new("found");
    let box_ = TriMesh::cuboid(Vec3::new(1.0, 2.0, 3.0)).translated(&Vec3::new(1.0, 0.0, 0.0));
    let mesh = folder.write("my_robot/meshes/box.obj", &obj(&box_, 0));
    let elsewhere =
        UrdfOptions { packages: [("other".to_owned(), folder.0.join("my_robot"))].into(), ..UrdfOptions::default() };
    for uri in [
        "package://my_robot/meshes/box.obj",
        "../meshes/box.obj",
        &format!("file://{}", mesh.display()),
        "package://other/meshes/box.obj",
    ] {
        let path = folder.write("my_robot/urdf/r.urdf", &with_meshes(uri, "2 2 -2", uri));
        let (body, notes) = load(path, &elsewhere).unwrap_or_else(|error| panic!("{uri}: {error}"));
        assert_eq!(notes, Vec::<String>::new());
        let Some(Shape::Mesh(shape)) = body.collidable().unwrap().shape(2) else { panic!("a mesh") };
        assert!((shape.volume() - 8.0 * 6.0).abs() < 1e-9, "scaled by 2 and not inside out, though mirrored");
        assert!(
            (body.part_pose(2).translation.vector - Vec3::new(2.0, 0.0, 0.0)).norm() < 1e-12,
            "the center of the scaled box"
        );
    }
}

#[test]
fn meshes_that_are_missing_open_or_in_another_format() {
    let folder = Folder::new("missing");
    let ball = TriMesh::icosphere(1.0, 2);
    folder.write("open.obj", &obj(&ball, 40));
    folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("ball.mesh", "");
    let skip = UrdfOptions { missing_meshes: MissingMeshes::Skip, ..UrdfOptions::default() };
    let file = |collision: &str, visual: &str| folder.write("r.urdf", &with_meshes(collision, "1 1 1", visual));

    let path = file("nowhere.stl", "open.obj");
    let error = load(&path, &UrdfOptions::default()).err().unwrap().to_string();
    assert!(error.starts_with(&format!("{}:2:", path.display())), "{error}");
    assert!(
        error.contains("nowhere.stl\" cannot be used for collision: there is no file")
            && error.ends_with("missing_meshes = \"skip\" (--missing-meshes skip) leaves the mesh out"),
        "{error}"
    );
    let (body, notes) = load(&path, &skip).unwrap();
    assert_eq!(body.collidable().unwrap().parts(), 2, "a link and the base");
    assert_eq!(notes, [format!("{}:2: collision mesh nowhere.stl: left out: there is no such file", path.display())]);
    let Some(Drawn::Mesh(drawn)) = body.renderable().unwrap().visuals()[0].drawn() else { panic!("a picture") };
    assert_eq!(drawn.triangles.len(), 320 - 40, "an open surface is drawn as it is, with its hole");

    let path = file("open.obj", "ball.mesh");
    let (body, notes) = load(&path, &UrdfOptions::default()).unwrap();
    let Some(Shape::Mesh(hull)) = body.collidable().unwrap().shape(2) else { panic!("a mesh") };
    assert!(
        hull.volume() > 0.9 * ball.signed_volume() && hull.volume() < ball.signed_volume() * (1.0 + 1e-6),
        "the hull of most of a ball"
    );
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(
        notes[0].ends_with(
            "visual mesh ball.mesh: left out: the format 'mesh' is not supported; supported are .stl, .obj, .ply and .dae"
        ),
        "{notes:?}"
    );
    assert!(notes[1].ends_with("open.obj: its surface is not closed, so its convex hull is used"), "{notes:?}");
    assert_eq!(body.renderable().unwrap().visuals().len(), 1, "what collides is drawn instead");

    let hulls = UrdfOptions { collision_meshes: CollisionMeshes::Hull, ..UrdfOptions::default() };
    assert!(load(file("open.obj", "open.obj"), &hulls).unwrap().1.is_empty());
    let error = load(file("flat.obj", "open.obj"), &UrdfOptions::default()).err().unwrap().to_string();
    assert!(error.contains("link \"b\": ") && error.contains("flat.obj: "), "{error}");
}

#[test]
fn files_that_cannot_be_read() {
    let folder = Folder::new("unread");
    let error = load(folder.0.join("none.urdf"), &UrdfOptions::default()).err().unwrap().to_string();
    assert!(error.contains("none.urdf: cannot read the URDF: "), "{error}");
    let path = folder.0.join("bytes.urdf");
    std::fs::write(&path, b"<robot>\n\xff</robot>").unwrap();
    let error = load(&path, &UrdfOptions::default()).err().unwrap().to_string();
    assert!(error.ends_with("bytes.urdf:2: byte 8 of the file is not UTF-8; a URDF is a UTF-8 text in XML"), "{error}");
}

#[test]
fn an_arm_cut_at_every_byte_or_changed_is_an_error_or_a_robot() {
    let try_it = |text: &str| {
        if let Err(error) = parse_model(text, "damaged.urdf", &UrdfOptions::default()) {
            assert!(error.to_string().starts_with("damaged.urdf:"), "{error}");
        }
    };
    for end in 0..ARM.len() {
        try_it(&ARM[..end]);
        for other in ["\"", "<", "/>", "-", "9", "nan", "é"] {
            try_it(&format!("{}{other}{}", &ARM[..end], &ARM[end + 1..]));
        }
    }
    try_it(&"<robot>".repeat(100_000));
    assert!(Path::new("damaged.urdf").parent().is_some());
}
