//! Visual meshes of robots: read when they are drawn, not checked as solids, and never collided
//! with.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use tumble_core::collide::{Shape, TriMesh};
use tumble_core::{ArticulatedBody, Drawn, Object, Settings, Visual, VisualGeometry, VisualMesh, World};
use tumble_scene::urdf::{UrdfOptions, load, model};
use tumble_scene::{SceneFile, overlap_notes, resolve_scene, shipped, visual_notes};

/// A folder for one test, removed when it goes out of scope.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = std::env::temp_dir().join(format!("tumble-visuals-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Folder(folder)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const MASS: &str = r#"<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>"#;

/// Returns a robot with one revolute joint with limits, whose link collides as a sphere and is
/// drawn by these files.
fn robot(visuals: &[&str]) -> String {
    let visual = |file: &&str| format!("<visual><geometry><mesh filename=\"{file}\"/></geometry></visual>");
    let visuals: String = visuals.iter().map(visual).collect();
    format!(
        "<robot name=\"r\"><link name=\"a\"/><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><limit lower=\"-1\" upper=\"2\" effort=\"5\" velocity=\"1\"/></joint>\n<link name=\"b\">{MASS}<collision><geometry><sphere radius=\"0.25\"/></geometry></collision>{visuals}</link></robot>"
    )
}

fn load_from(path: &Path) -> (ArticulatedBody, Vec<String>) {
    load(path, &UrdfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn visuals(body: &ArticulatedBody) -> &[Visual] {
    body.renderable().unwrap().visuals()
}

fn meshes(body: &ArticulatedBody) -> Vec<Arc<VisualMesh>> {
    let mesh = |v: &Visual| if let VisualGeometry::Mesh(mesh) = &v.geometry { Some(mesh.clone()) } else { None };
    visuals(body).iter().filter_map(mesh).collect()
}

/// Two triangles that share an edge, each with vertices of its own: no solid.
const SHEET: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";

#[test]
fn loading_reads_no_visual_mesh() {
    let folder = Folder::new("lazy");
    let path = folder.write("r.urdf", robot(&["sheet.obj", "garbage.stl"]));
    let sheet = folder.write("sheet.obj", SHEET);
    folder.write("garbage.stl", [7; 1000]);
    let (body, notes) = load_from(&path);
    assert_eq!(notes, Vec::<String>::new());
    assert_eq!(meshes(&body).len(), 2);
    let mut world = World::new(Settings::default()).unwrap();
    let id = world.add(body.clone()).unwrap();
    let mut fork = world.fork();
    world.step().unwrap();
    fork.step().unwrap();
    assert_eq!(world.save(), fork.save());
    assert!(meshes(&body).iter().all(|mesh| !mesh.is_read()), "nobody has drawn it");
    assert_eq!(visual_notes(world.visuals()), Vec::<String>::new());

    // the file is read when it is drawn, with its content at that time
    std::fs::write(&sheet, SHEET.replace("f 4 5 6\n", "")).unwrap();
    let drawn: Vec<Drawn<'_>> = visuals(&body).iter().filter_map(Visual::drawn).collect();
    let [Drawn::Mesh(mesh)] = drawn[..] else { panic!("{drawn:?}") };
    assert_eq!(mesh.triangles.len(), 1, "the ball stays away, since one of two meshes can be read");
    let notes = visual_notes(world.visuals());
    assert_eq!(notes.len(), 1, "{notes:?}");
    let garbage = folder.0.join("garbage.stl").display().to_string();
    assert!(notes[0].starts_with(&format!("visual mesh {garbage}: left out: ")), "{notes:?}");
    assert!(world.object(id).unwrap().collidable().unwrap().shape(2).is_some());
}

#[test]
fn a_link_whose_meshes_are_lost_is_drawn_as_it_collides() {
    let folder = Folder::new("lost");
    let path = folder.write("r.urdf", robot(&["gone.obj", "pipe.obj"]));
    folder.write("gone.obj", SHEET);
    folder.write("pipe.obj", SHEET);
    let (body, notes) = load_from(&path);
    assert_eq!(notes, Vec::<String>::new());
    for name in ["gone.obj", "pipe.obj"] {
        std::fs::remove_file(folder.0.join(name)).unwrap();
    }
    // a pipe without a writer would block its reader forever
    assert!(Command::new("mkfifo").arg(folder.0.join("pipe.obj")).status().unwrap().success());
    let drawn: Vec<Drawn<'_>> = visuals(&body).iter().filter_map(Visual::drawn).collect();
    assert!(matches!(drawn[..], [Drawn::Shape(Shape::Sphere { radius: 0.25 })]), "{drawn:?}");
    let notes = visual_notes(visuals(&body));
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("gone.obj: left out: cannot be read: No such file"), "{notes:?}");
    assert!(notes[1].ends_with("pipe.obj: left out: cannot be read: it is not a regular file"), "{notes:?}");
}

#[test]
fn the_same_content_stands_in_memory_once() {
    let folder = Folder::new("shared");
    let path = folder.write("r.urdf", robot(&["one.obj", "two.obj", "one.obj"]));
    folder.write("one.obj", SHEET);
    folder.write("two.obj", SHEET);
    let (first, second) = (load_from(&path).0, load_from(&path).0);
    let all: Vec<Arc<VisualMesh>> = meshes(&first).into_iter().chain(meshes(&second)).collect();
    assert!(Arc::ptr_eq(&all[0], &all[2]), "one file of one robot");
    let read: Vec<&Arc<TriMesh>> = all.iter().map(|mesh| mesh.triangles().unwrap()).collect();
    assert!(read.iter().all(|mesh| Arc::ptr_eq(mesh, read[0])));
    assert_eq!((read[0].vertices.len(), read[0].triangles.len()), (4, 2), "corners at one place are one");
}

#[test]
fn limits_need_no_mesh() {
    let folder = Folder::new("limits");
    let text = robot(&[]).replace("<sphere radius=\"0.25\"/>", "<mesh filename=\"nowhere.stl\"/>");
    let read = model(folder.write("r.urdf", text), &UrdfOptions::default()).unwrap();
    assert_eq!(read.dofs.len(), read.model.dof());
    assert_eq!(read.dofs[0].limits, Some([-1.0, 2.0]));
}

/// Three balls of radius 0.5 m in a row: the first two 0.9 m apart, the third 0.05 m deep in the
/// ground.
#[test]
fn bodies_that_overlap_at_the_start_are_named() {
    let ball = |name: &str, x: f64, z: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass_kg = 1\nposition_m = [{x}, 0, {z}]\nshape = {{ type = \"sphere\", radius_m = 0.5 }}\n"
        )
    };
    let ground = "[[body]]\nname = \"ground\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n";
    let text = format!("{ground}{}{}{}", ball("left", 0.0, 0.5), ball("right", 0.9, 0.5), ball("deep", 5.0, 0.45));
    let (world, notes) = SceneFile::parse(&text, "s.toml").unwrap().build().unwrap();
    assert_eq!(notes, Vec::<String>::new());
    assert_eq!(
        overlap_notes(&world),
        ["left and right overlap by 1.00e-1 m at the start", "ground and deep overlap by 5.00e-2 m at the start"]
    );
    let crowd: String = (0..11).map(|k| ball(&format!("b{k}"), 0.9 * f64::from(k), 3.0)).collect();
    let (world, _) = SceneFile::parse(&crowd, "s.toml").unwrap().build().unwrap();
    let notes = overlap_notes(&world);
    assert_eq!(notes.len(), 9, "{notes:?}");
    assert_eq!(notes[8], "2 more pairs of bodies overlap at the start");
}

/// Returns all shapes of a world, for collision or drawing.
fn shapes(world: &World) -> impl Iterator<Item = &Shape> {
    let drawn = world.visuals().filter_map(|visual| match &visual.geometry {
        VisualGeometry::Shape(shape) => Some(shape),
        VisualGeometry::Mesh(_) => None,
    });
    let bodies = world.ids().iter().filter_map(|&id| world.object(id)?.collidable());
    drawn.chain(bodies.flat_map(|body| (0..body.parts()).filter_map(|part| body.shape(part))))
}

#[test]
fn a_world_that_is_only_drawn_builds_no_tree_and_no_field() {
    let mut built = 0;
    for scene in shipped() {
        let scene = resolve_scene(scene.name, &[]).unwrap().load().unwrap();
        let (stepped, drawn) = (scene.build().unwrap().0, scene.build_drawn().unwrap().0);
        built += shapes(&stepped).filter(|shape| shape.is_built()).count();
        assert_eq!(shapes(&stepped).count(), shapes(&drawn).count());
        assert!(!shapes(&drawn).any(Shape::is_built), "{}", scene.file);
        let poses = |world: &World| -> Vec<_> { world.part_states().iter().map(|site| site.pose).collect() };
        assert_eq!(poses(&stepped), poses(&drawn), "{}", scene.file);
    }
    assert!(built > 0, "scenes with meshes are among them");
}
