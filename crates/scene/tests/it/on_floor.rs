//! Robots and meshes opened as scenes of their own.

use std::path::PathBuf;

use tumble_scene::{FileKind, LoadOptions, Mode, SceneError, SceneFile, ShapeSpec, resolve_scene, urdf::UrdfOptions};

/// A new folder for one test, removed when it goes out of scope.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble-scene-{}-floor-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the folder for temporary files can be written");
        Folder(path)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("can be written");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const TETRAHEDRON: &str = "v 1 1 5\nv 3 1 5\nv 1 3 5\nv 1 1 7\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

fn link(name: &str, shape: &str) -> String {
    let inertia = "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>";
    format!("<link name=\"{name}\"><inertial><mass value=\"1\"/>{inertia}</inertial>{shape}</link>\n")
}

/// Returns a robot with a revolute joint about y at z = 3 whose limits exclude 0, a prismatic joint
/// that mimics it, and a mesh below.
fn robot() -> String {
    let ball = "<collision><geometry><sphere radius=\"0.25\"/></geometry></collision>";
    let mesh = "<collision><origin xyz=\"0 0 -8\"/><geometry><mesh filename=\"t.obj\" scale=\"1 1 0.5\"/></geometry></collision>";
    let joint = |name: &str, kind: &str, parent: &str, child: &str, rest: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{rest}</joint>\n"
        )
    };
    let hinge =
        "<origin xyz=\"0 0 3\"/><axis xyz=\"0 0 1\"/><limit lower=\"0.5\" upper=\"2\" effort=\"1\" velocity=\"1\"/>";
    let slide = "<axis xyz=\"0 0 1\"/><limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/><mimic joint=\"hinge\" multiplier=\"-4\" offset=\"1\"/>";
    format!(
        "<robot name=\"floor\">{}{}{}{}{}</robot>",
        link("base", ball),
        link("arm", mesh),
        link("finger", ball),
        joint("hinge", "revolute", "base", "arm", hinge),
        joint("slide", "prismatic", "base", "finger", slide),
    )
}

#[test]
fn the_floor_goes_through_the_lowest_point_of_a_robot_within_its_limits() {
    let folder = Folder::new("robot");
    folder.write("t.obj", TETRAHEDRON);
    let path = folder.write("r.urdf", &robot());
    let scene = SceneFile::load(&path).unwrap();
    let spec = &scene.articulated[0];
    let start = |name: &str| spec.links[spec.link(name).unwrap()].joint.position[0];
    // 0 is below the limits of the revolute joint; the prismatic joint follows: 1 - 4 * 0.5
    assert_eq!((start("arm"), start("finger")), (0.5, -1.0));
    // the lowest vertex of the mesh is at 3 - 8 + 0.5 * 5
    assert_eq!(scene.bodies[0].position_m[2], -2.5);
    assert_eq!(scene.ground.as_ref().unwrap().height_m, -2.5);
    // the robot has the floor's name
    assert_eq!((spec.name.as_str(), scene.bodies[0].name.as_str()), ("floor", "ground"));
    assert!(scene.has_fixed_base());
    let (world, _) = scene.build().unwrap();
    assert_eq!(world.ids().len(), 2);

    let options =
        LoadOptions { urdf: UrdfOptions { floating: true, ..UrdfOptions::default() }, ..LoadOptions::default() };
    assert!(!SceneFile::load_with(&path, &options).unwrap().has_fixed_base());
}

/// A table of one link stands where it is, also without a mass.
#[test]
fn a_robot_without_movable_joints_is_static() {
    let folder = Folder::new("table");
    let top = "<collision><origin xyz=\"0 0 0.5\"/><geometry><box size=\"1 1 0.1\"/></geometry></collision>";
    for table in [link("top", top), format!("<link name=\"top\">{top}</link>")] {
        let path = folder.write("t.urdf", &format!("<robot name=\"table\">{table}</robot>"));
        let scene = SceneFile::load(&path).unwrap();
        assert!(scene.has_fixed_base());
        let (mut world, _) = scene.build().unwrap();
        let before = world.pose(world.find("table").unwrap(), 0).unwrap();
        for _ in 0..60 {
            world.step().unwrap();
        }
        assert_eq!(world.pose(world.find("table").unwrap(), 0).unwrap(), before);
    }
}

#[test]
fn the_camera_frames_what_stands_there() {
    let folder = Folder::new("camera");
    let scene = SceneFile::load(folder.write("t.obj", TETRAHEDRON)).unwrap();
    let camera = scene.camera.unwrap();
    // the box is 2 m wide and reaches from the floor to z = 7
    let height = 2.0 + 0.1 * 12f64.sqrt();
    assert!((0..3).all(|k| (camera.target_m[k] - [2.0, 2.0, 7.0 - 0.5 * height][k]).abs() < 1e-12));
    // the sphere around it fills the picture from edge to edge
    let distance = (0..3).map(|k| (camera.eye_m[k] - camera.target_m[k]).powi(2)).sum::<f64>().sqrt();
    assert!((distance * 20f64.to_radians().sin() - 0.5 * (8.0 + height * height).sqrt()).abs() < 1e-9, "{distance}");
    assert!(camera.eye_m[2] > 7.0);
}

#[test]
fn a_mesh_keeps_the_frame_of_its_file_above_the_floor() {
    let folder = Folder::new("mesh");
    let path = folder.write("t.obj", TETRAHEDRON);
    let scene = resolve_scene(path.to_str().unwrap(), &[]).unwrap().load().unwrap();
    let (floor, body) = (&scene.bodies[0], &scene.bodies[1]);
    assert_eq!((body.name.as_str(), body.mode, body.position_m), ("t", Mode::Dynamic, [0.0; 3]));
    assert_eq!(body.shape, ShapeSpec::Mesh { mesh: 0 });
    assert!((floor.position_m[2] - (5.0 - 0.1 * 12f64.sqrt())).abs() < 1e-12);
    let (world, _) = scene.build().unwrap();
    // a tetrahedron has its center of mass at the mean of its corners
    let energy = world.energy().potential;
    // 2 * 2 * 2 / 6 m³ of water at z = (5 + 5 + 5 + 7) / 4
    assert!((energy / (1000.0 * 8.0 / 6.0 * 9.81 * 5.5) - 1.0).abs() < 1e-9, "{energy}");
}

#[test]
fn kinds_of_files_go_by_the_extension() {
    let kind = |name: &str| FileKind::of(name.as_ref());
    assert_eq!(kind("a/b.URDF"), Ok(FileKind::Urdf));
    assert_eq!((kind("a.Ply"), kind("a.dae")), (Ok(FileKind::Mesh), Ok(FileKind::Mesh)));
    assert_eq!(
        (kind("scene.toml"), kind("stack"), kind("a.b/c")),
        (Ok(FileKind::Scene), Ok(FileKind::Scene), Ok(FileKind::Scene))
    );
    assert!(kind("a.gltf").unwrap_err().contains("the mesh format .gltf is not supported"));
}

#[test]
fn what_is_wrong_with_a_robot_is_reported_in_its_own_file() {
    let folder = Folder::new("wrong");
    let path = folder.write("r.urdf", "<robot name=\"r\">\n<lnk/></robot>");
    let error = SceneFile::load(&path).unwrap_err();
    assert!(matches!(error, SceneError::Urdf(_)), "{error}");
    assert!(error.to_string().starts_with(&format!("{}:1:", path.display())), "{error}");
}
