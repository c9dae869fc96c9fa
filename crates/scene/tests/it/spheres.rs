//! Replacement of collision geometry by spheres: which elements are replaced, which stay, and that
//! the spheres cover every point of the collision surface.

use std::path::PathBuf;
use tumble_core::Object;
use tumble_core::collide::{Builder, Pose, Shape, TreeCache, TreeSettings, TriMesh, Vec3};
use tumble_scene::urdf::{LinkSpheres, PerLink, SphereOptions, SphereRobot, UrdfError, UrdfOptions, load, spherize};

const ROBOT: &str = r#"<?xml version="1.0"?>
<!-- a robot of every shape -->
<robot name="shapes" xmlns:drake="http://drake.mit.edu">
  <material name="red"><color rgba="0.8 0.1 0.1 1"/></material>
  <link name="base"/>
  <joint name="mount" type="fixed"><parent link="base"/><child link="arm"/></joint>
  <link name="arm">
    <inertial><mass value="3"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
    <collision name="block" group="a&amp;b">
      <!-- keep me -->
      <origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.4 0.5"/>
      <geometry><box size="0.4 0.2 0.1"/></geometry>
      <drake:proximity_properties><drake:mu_static value="0.9"/></drake:proximity_properties>
    </collision>
    <collision><origin xyz="0 0 1" rpy="1 0 0"/><geometry><cylinder radius="0.05" length="0.6"/></geometry></collision>
    <collision name="pad"><origin xyz="0 1 0"/><geometry><sphere radius="0.06"/></geometry></collision>
  </link>
  <joint name="j" type="continuous"><parent link="arm"/><child link="tip"/><origin xyz="0 0 0.5"/></joint>
  <link name="tip">
    <inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
    <collision><origin xyz="0 0 0.4" rpy="0 1 0"/><geometry><capsule radius="0.05" length="0.3"/></geometry></collision>
    <collision><origin rpy="0 0 1"/><geometry><mesh filename="ring.obj" scale="0.1 -0.2 0.1"/></geometry></collision>
    <collision><origin xyz="1 0 0"/><geometry><mesh filename="bowl.obj"/></geometry></collision>
  </link>
  <transmission name="t"><actuator name="m"/></transmission>
</robot>
"#;

fn obj(mesh: &TriMesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    vertices.chain(faces).collect()
}

fn ring() -> TriMesh {
    TriMesh::torus(1.0, 0.3, 24, 12)
}

/// Returns the lower half of a sphere, open above.
fn bowl() -> TriMesh {
    let mut ball = TriMesh::uv_sphere(0.2, 16, 12);
    let below = |t: &[u32; 3]| t.iter().all(|&v| ball.vertices[v as usize].z < 1e-9);
    ball.triangles = ball.triangles.iter().filter(|t| below(t)).copied().collect();
    ball
}

struct Folder(PathBuf);

impl Folder {
    fn new(test: &str, robot: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble-spheres-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("ring.obj"), obj(&ring())).unwrap();
        std::fs::write(path.join("bowl.obj"), obj(&bowl())).unwrap();
        std::fs::write(path.join("robot.urdf"), robot).unwrap();
        Folder(path)
    }

    fn spherize(&self, options: &SphereOptions) -> Result<SphereRobot, UrdfError> {
        spherize(self.0.join("robot.urdf"), options, &())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn options(most: usize) -> SphereOptions {
    let tree = TreeSettings { depth: 4, ..TreeSettings::octree() };
    SphereOptions {
        most: PerLink::all(most),
        coverage: PerLink::all(None),
        weight: PerLink::all(None),
        error: 1e-3,
        tree,
        cache: TreeCache::off(),
        urdf: UrdfOptions::default(),
    }
}

/// Returns the pose of an origin: roll, pitch and yaw about fixed axes.
fn at(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Pose {
    Pose::from_parts(Vec3::from(xyz).into(), nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// Returns points of the surface of a mesh: the vertices of its triangles, and points inside its
/// triangles.
fn points(mesh: &TriMesh, pose: Pose) -> Vec<Vec3> {
    let inside = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        [(0.2, 0.3), (0.6, 0.2), (0.1, 0.8), (0.5, 0.5), (1.0 / 3.0, 1.0 / 3.0)]
            .map(|(u, v)| a + (b - a) * u + (c - a) * v)
    };
    let corners = (0..mesh.triangles.len()).flat_map(|t| mesh.corners(t));
    let all = corners.chain((0..mesh.triangles.len()).flat_map(inside));
    all.map(|p| (pose * nalgebra::Point3::from(p)).coords).collect()
}

/// Returns points of the surface by formula, for the links in the text of [`ROBOT`].
fn surface(link: &str) -> Vec<Vec3> {
    let scaled = |mesh: TriMesh, by: Vec3| TriMesh {
        vertices: mesh.vertices.iter().map(|v| v.component_mul(&by)).collect(),
        ..mesh
    };
    // fine meshes whose vertices lie on the exact cylinder and capsule; points inside their
    // triangles lie slightly inside
    match link {
        "arm" => [
            points(&TriMesh::cuboid(Vec3::new(0.4, 0.2, 0.1)), at([0.1, -0.2, 0.3], [0.3, -0.4, 0.5])),
            points(&TriMesh::cylinder(0.05, 0.6, 360), at([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])),
            points(&TriMesh::icosphere(0.06 * (1.0 - 1e-12), 3), at([0.0, 1.0, 0.0], [0.0; 3])),
        ]
        .concat(),
        _ => [
            points(&TriMesh::capsule(0.05, 0.3, 90, 30), at([0.0, 0.0, 0.4], [0.0, 1.0, 0.0])),
            points(&scaled(ring(), Vec3::new(0.1, -0.2, 0.1)), at([0.0; 3], [0.0, 0.0, 1.0])),
            points(&bowl(), at([1.0, 0.0, 0.0], [0.0; 3])),
        ]
        .concat(),
    }
}

fn assert_covered(link: &LinkSpheres) {
    for p in surface(&link.name) {
        let gap = link.spheres.iter().map(|(c, r)| (p - c).norm() - r).fold(f64::INFINITY, f64::min);
        assert!(gap <= 0.0, "{}: {p:?} is {gap:e} m outside all {} spheres", link.name, link.spheres.len());
    }
}

#[test]
fn no_point_of_the_collision_surface_is_bare_with_any_number_of_spheres() {
    let folder = Folder::new("covered", ROBOT);
    let mut last = f64::INFINITY;
    for most in [3, 64, 300] {
        let robot = folder.spherize(&options(most)).unwrap();
        assert_eq!(
            robot.links.iter().map(|l| (l.name.as_str(), l.shapes)).collect::<Vec<_>>(),
            [("arm", 3), ("tip", 3)]
        );
        for link in &robot.links {
            assert!(link.spheres.len() <= most.max(3), "{}: {} of {most}", link.name, link.spheres.len());
            assert_eq!(link.spheres.len(), link.outward.len());
            assert_covered(link);
        }
        let worst = robot.links.iter().flat_map(|l| l.outward.iter().copied()).fold(0.0, f64::max);
        // one sphere around all, then tighter ones
        assert!(worst < last, "{most}: {worst} after {last}");
        last = worst;
        eprintln!(
            "at most {most}: {:?} spheres, {:.1} mm outside",
            robot.links.iter().map(|l| l.spheres.len()).collect::<Vec<_>>(),
            1e3 * worst
        );
    }
}

#[test]
fn what_is_written_is_what_our_own_reader_reads() {
    let folder = Folder::new("roundtrip", ROBOT);
    let robot = folder.spherize(&options(40)).unwrap();
    let out = folder.0.join("out.urdf");
    std::fs::write(&out, &robot.text).unwrap();
    let (before, _) = load(folder.0.join("robot.urdf"), &UrdfOptions::default()).unwrap();
    let (body, notes) = load(&out, &UrdfOptions::default()).unwrap();
    assert_eq!((before.model(), notes), (body.model(), Vec::<String>::new()));
    // the arm is fixed to the base, the tip is the only link that moves: two parts
    let collidable = body.collidable().unwrap();
    let mut read: Vec<f64> = Vec::new();
    for part in 0..collidable.parts() {
        match collidable.shape(part) {
            Some(Shape::Sphere { radius }) => read.push(*radius),
            Some(other) => panic!("{other:?}"),
            None => {}
        }
    }
    let mut radii: Vec<f64> = robot.links.iter().flat_map(|l| l.spheres.iter().map(|s| s.1)).collect();
    radii.sort_by(f64::total_cmp);
    read.sort_by(f64::total_cmp);
    assert_eq!(read, radii);
}

#[test]
fn all_else_of_the_file_stays() {
    let folder = Folder::new("kept", ROBOT);
    let text = folder.spherize(&options(60)).unwrap().text;
    let is_new = |line: &&str| line.trim_start().starts_with("<collision") && line.contains("<sphere");
    let spheres: Vec<&str> = text.lines().filter(is_new).collect();
    // without the new lines, the text before and after the replaced elements is unchanged
    for kept in [
        "<!-- a robot of every shape -->",
        "<visual><geometry><box size=\"1 1 1\"/></geometry></visual>",
        "<!-- keep me -->",
        "<transmission name=\"t\"><actuator name=\"m\"/></transmission>",
        "<material name=\"red\"><color rgba=\"0.8 0.1 0.1 1\"/></material>",
    ] {
        assert_eq!(text.matches(kept).count(), 1, "{kept}");
    }
    assert!(!text.contains("cylinder") && !text.contains("<capsule") && !text.contains("<mesh"));
    let blocks: Vec<&&str> = spheres.iter().filter(|line| line.contains("name=\"block_")).collect();
    assert!(blocks.len() > 1);
    for block in blocks {
        assert!(block.starts_with("    <collision name=\"block_"), "{block}");
        assert!(
            block.contains("group=\"a&amp;b\"")
                && block.contains(
                    "<drake:proximity_properties><drake:mu_static value=\"0.9\"/></drake:proximity_properties>"
                )
        );
    }
    // a robot that has spheres only stays unchanged
    let again = Folder::new("again", &text);
    assert_eq!(again.spherize(&options(60)).unwrap().text, text);
}

/// Returns how far `count` equal spheres on the axis of a capsule extend outside at least, found by
/// bisection: the spheres cover `2 h` at the ends and the side between `count` centers.
fn chain(radius: f64, length: f64, count: usize) -> f64 {
    let covered = |h: f64| 2.0 * h + 2.0 * (count - 1) as f64 * (2.0 * radius * h + h * h).sqrt();
    let (mut low, mut high) = (0.0, length);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *(if covered(middle) < length { &mut low } else { &mut high }) = middle;
    }
    high
}

/// A chain from end to end, of radius √(R² + d²/4) at the distance d.
fn plain_chain(radius: f64, length: f64, count: usize) -> f64 {
    radius.hypot(0.5 * length / (count - 1) as f64) - radius
}

#[test]
fn a_capsule_is_covered_by_formula() {
    let robot = r#"<robot name="r"><link name="l"><collision><geometry><capsule radius="0.1" length="0.6"/></geometry></collision></link></robot>"#;
    let folder = Folder::new("one-capsule", robot);
    for most in [1, 2, 3, 4, 8, 16, 32] {
        let reach = chain(0.1, 0.6, most);
        let made = folder.spherize(&SphereOptions { error: 1e-6, ..options(most) }).unwrap();
        let link = &made.links[0];
        assert_eq!(link.spheres.len(), most);
        // radii are written with 1e-9 more, so that rounding in other programs uncovers nothing
        let more = |c: &Vec3| 1e-9 * (0.1 + reach + c.norm());
        let exact = |(o, (c, _)): (&f64, &(Vec3, f64))| (o - reach - more(c)).abs() < 1e-12;
        assert!(link.outward.iter().zip(&link.spheres).all(exact), "{most}: {:?} {reach}", link.outward);
        assert!(link.spheres.iter().all(|(c, r)| c.z.abs() <= 0.3 && (r - 0.1 - reach).abs() < 1e-8));
        assert!(most == 1 || reach < plain_chain(0.1, 0.6, most));
        for p in points(&TriMesh::capsule(0.1, 0.6, 180, 45), at([0.0; 3], [0.0; 3])) {
            assert!(link.spheres.iter().any(|(c, r)| (p - c).norm() <= *r), "{most}: {p:?}");
        }
    }
    // with `error`, it takes as many spheres as that needs
    let loose = SphereOptions { error: 0.01, ..options(1000) };
    let link = folder.spherize(&loose).unwrap().links.remove(0);
    let diagonal = (0.04_f64 + 0.04 + 0.64).sqrt();
    assert!(link.outward.iter().all(|o| *o <= 0.01 * diagonal) && link.spheres.len() < 20, "{}", link.spheres.len());
}

#[test]
fn a_robot_with_faults_is_refused_as_by_the_reader() {
    let folder = Folder::new("faults", &ROBOT.replace("radius=\"0.06\"", "radius=\"-1\""));
    let error = folder.spherize(&options(8)).unwrap_err().to_string();
    assert!(error.contains("robot.urdf:17") && error.contains("`radius`"), "{error}");
    let folder = Folder::new("missing", &ROBOT.replace("ring.obj", "none.obj"));
    let error = folder.spherize(&options(8)).unwrap_err().to_string();
    assert!(error.contains("none.obj"), "{error}");
}

/// Returns a robot with one link of a box, a cylinder, a rod, or several of them.
fn one_link(shapes: &str) -> String {
    let collisions = shapes.split(';').map(|shape| format!("<collision><geometry>{shape}</geometry></collision>"));
    format!("<robot name=\"r\"><link name=\"l\">{}</link></robot>", collisions.collect::<String>())
}

#[test]
fn more_spheres_never_reach_further_and_are_never_too_many() {
    for (name, shapes) in [("cube", "<box size=\"1 1 1\"/>"), ("cylinder", "<cylinder radius=\"0.05\" length=\"1\"/>")]
    {
        let folder = Folder::new(name, &one_link(shapes));
        let tree = TreeSettings { builder: Builder::Grid, ..TreeSettings::default() };
        let mut last = (0, f64::INFINITY);
        for most in [1, 2, 3, 4, 5, 8, 16, 17, 33, 64, 65, 100] {
            let link = folder
                .spherize(&SphereOptions { tree, cache: TreeCache::at(folder.0.join("trees")), ..options(most) })
                .unwrap()
                .links
                .remove(0);
            let worst = link.outward.iter().copied().fold(0.0, f64::max);
            assert!(
                link.spheres.len() <= most && worst <= last.1,
                "{name} {most}: {} reach {worst}, {last:?} before",
                link.spheres.len()
            );
            assert!(most > 5 || link.spheres.len() == most, "{name}: {} of {most}", link.spheres.len());
            last = (link.spheres.len(), worst);
            eprintln!("{name} {most}: {} spheres, {:.2} mm", link.spheres.len(), 1e3 * worst);
        }
    }
}

#[test]
fn the_shape_that_is_covered_worst_gets_the_next_sphere() {
    // a thin rod has 1.5 % of the surface, and one sphere around it extends half a meter outside
    let folder = Folder::new("rod", &one_link("<box size=\"1 1 0.1\"/>;<cylinder radius=\"0.005\" length=\"1\"/>"));
    for most in [16, 32, 64] {
        let link = folder.spherize(&options(most)).unwrap().links.remove(0);
        let rod: Vec<f64> = link
            .spheres
            .iter()
            .zip(&link.outward)
            .filter(|((c, _), _)| c.xy().norm() < 1e-2)
            .map(|(_, o)| *o)
            .collect();
        let worst = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        assert!(
            link.spheres.len() == most && rod.len() > 2,
            "{most}: {} spheres, {} on the rod",
            link.spheres.len(),
            rod.len()
        );
        assert!(worst(&rod) < 0.25, "{most}: {rod:?}");
    }
    // one sphere covers both
    let link = folder.spherize(&options(1)).unwrap().links.remove(0);
    assert_eq!((link.shapes, link.spheres.len()), (2, 1));
}

#[test]
fn a_robot_without_masses_is_covered() {
    let robot = ROBOT.lines().filter(|line| !line.contains("<inertial>")).collect::<Vec<_>>().join("\n");
    let folder = Folder::new("kinematic", &robot);
    assert!(load(folder.0.join("robot.urdf"), &UrdfOptions::default()).is_err());
    let covered = folder.spherize(&options(12)).unwrap();
    assert_eq!(covered.links.len(), 2);
    covered.links.iter().for_each(assert_covered);
}

/// A cylinder between two spheres, the usual capsule of a link, is covered as a capsule.
#[test]
fn a_cylinder_between_two_spheres_is_covered_as_a_capsule() {
    let (radius, length) = (0.06, 0.27);
    let element = |z: f64, shape: &str| {
        format!("<collision><origin xyz=\"0 0 {z}\"/><geometry><{shape}/></geometry></collision>")
    };
    let robot = |end: f64| {
        let ball = format!("sphere radius=\"{end}\"");
        let elements = [
            element(0.1, &format!("cylinder radius=\"{radius}\" length=\"{length}\"")),
            element(0.1 - 0.5 * length, &ball),
            element(0.1 + 0.5 * length, &ball),
        ];
        format!("<robot name=\"r\"><link name=\"capsule\">{}</link></robot>", elements.concat())
    };
    let worst = |end: f64, most: usize| {
        let folder = Folder::new("capsule", &robot(end));
        let fine = SphereOptions { error: 1e-5, ..options(most) };
        let link = folder.spherize(&fine).unwrap().links.remove(0);
        assert!(link.spheres.len() <= most);
        for p in points(&TriMesh::cylinder(radius, length, 360), at([0.0, 0.0, 0.1], [0.0; 3])) {
            let gap = link.spheres.iter().map(|(c, r)| (p - c).norm() - r).fold(f64::INFINITY, f64::min);
            assert!(gap <= 0.0, "{p:?} is {gap:e} m outside all {} spheres", link.spheres.len());
        }
        // how far each sphere reaches outside the capsule of that radius: its distance from the axis, and its radius
        let half = 0.5 * length;
        let reach = |(c, r): &(Vec3, f64)| {
            let z = (c.z - 0.1).abs() - half;
            c.x.hypot(c.y).hypot(z.max(0.0)) + r - end.max(radius)
        };
        link.spheres.iter().map(reach).fold(0.0, f64::max)
    };
    for most in [4, 8, 16, 32] {
        let (found, smaller) = (worst(radius, most), worst(0.9 * radius, most));
        println!("{most} spheres: {:.2} mm outside; {:.2} mm if the ends are smaller", 1e3 * found, 1e3 * smaller);
        let wanted = chain(radius, length, most);
        assert!((found - wanted).abs() < 1e-6, "{most}: {found}, {wanted}");
        assert!(found < plain_chain(radius, length, most));
        // ends that do not contain those of the cylinder are no capsule
        assert!(smaller > wanted);
    }
}

/// Returns the signed distance to a box.
fn to_box(p: Vec3, center: Vec3, half: Vec3) -> f64 {
    let q = (p - center).abs() - half;
    q.sup(&Vec3::zeros()).norm() + q.max().min(0.0)
}

/// Two boxes that overlap and make a longer one: their inner faces need no sphere, and the outward
/// error is that to the longer box.
#[test]
fn overlapping_boxes_are_covered_as_their_union() {
    let part = |x: f64| {
        format!("<collision><origin xyz=\"{x} 0 0\"/><geometry><box size=\"0.6 0.2 0.2\"/></geometry></collision>")
    };
    let robot = format!("<robot name=\"r\"><link name=\"l\">{}{}</link></robot>", part(-0.2), part(0.2));
    let folder = Folder::new("two-boxes", &robot);
    let whole = Folder::new("one-box", &one_link("<box size=\"1 0.2 0.2\"/>"));
    let boxes = [Vec3::new(-0.2, 0.0, 0.0), Vec3::new(0.2, 0.0, 0.0)];
    let half = Vec3::new(0.3, 0.1, 0.1);
    for most in [1, 3, 8, 20] {
        let link = folder.spherize(&options(most)).unwrap().links.remove(0);
        let one = whole.spherize(&options(most)).unwrap().links.remove(0);
        let worst = |link: &LinkSpheres| link.outward.iter().copied().fold(0.0, f64::max);
        println!("{most}: {:.2} mm, one box {:.2} mm", 1e3 * worst(&link), 1e3 * worst(&one));
        assert!(link.spheres.len() <= most && worst(&link) < 1.1 * worst(&one), "{most}");
        for p in points(&TriMesh::cuboid(Vec3::new(1.0, 0.2, 0.2)), Pose::identity()) {
            assert!(link.spheres.iter().any(|(c, r)| (p - c).norm() <= *r), "{most}: {p:?}");
        }
        // no point of a sphere is further outside than its bound
        for ((c, r), bound) in link.spheres.iter().zip(&link.outward) {
            for p in
                points(&TriMesh::icosphere(*r, 2), Pose::from_parts((*c).into(), nalgebra::UnitQuaternion::identity()))
            {
                let outside = boxes.iter().map(|center| to_box(p, *center, half)).fold(f64::INFINITY, f64::min);
                assert!(outside <= bound + 1e-6, "{most}: {outside} beyond {bound}");
            }
        }
    }
    // without the overlap, each box alone would need two spheres to reach as little
    let text = folder.spherize(&options(1)).unwrap().text;
    assert_eq!(text.matches("<collision").count(), 1, "{text}");
}

#[test]
fn less_coverage_is_tighter_and_as_stated() {
    let folder = Folder::new("coverage", ROBOT);
    let mut last = 0.0;
    for coverage in [0.5, 0.8, 0.95, 1.0] {
        let robot = folder.spherize(&SphereOptions { coverage: PerLink::all(Some(coverage)), ..options(8) }).unwrap();
        let link = &robot.links[0];
        let worst = link.outward.iter().copied().fold(0.0, f64::max);
        // even samples of the box, the cylinder and the sphere of the arm, by area
        let even = |mesh: &TriMesh, pose: Pose| {
            let split = |t: usize| {
                let [a, b, c] = mesh.corners(t);
                let n = 1 + (0.5 * (b - a).cross(&(c - a)).norm() / 2e-6) as usize;
                (0..n).map(move |k| {
                    let (u, v) = ((k as f64 * 2f64.sqrt()).fract(), (k as f64 * 3f64.sqrt()).fract());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    a + (b - a) * u + (c - a) * v
                })
            };
            (0..mesh.triangles.len())
                .flat_map(split)
                .map(|p| (pose * nalgebra::Point3::from(p)).coords)
                .collect::<Vec<Vec3>>()
        };
        let samples = [
            even(&TriMesh::cuboid(Vec3::new(0.4, 0.2, 0.1)), at([0.1, -0.2, 0.3], [0.3, -0.4, 0.5])),
            even(&TriMesh::cylinder(0.05, 0.6, 64), at([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])),
            even(&TriMesh::uv_sphere(0.06 * (1.0 - 1e-9), 32, 16), at([0.0, 1.0, 0.0], [0.0; 3])),
        ]
        .concat();
        let covered = samples.iter().filter(|p| link.spheres.iter().any(|(c, r)| (*p - c).norm() <= *r)).count();
        let measured = covered as f64 / samples.len() as f64;
        println!("{coverage}: stated {:.4}, measured {measured:.4}, {:.2} mm outside", link.coverage, 1e3 * worst);
        assert!(link.coverage >= coverage && measured >= link.coverage - 2e-3, "{coverage}: {measured}");
        assert!(worst > last, "{coverage}: {worst} after {last}");
        last = worst;
    }
}

#[test]
fn links_have_numbers_of_their_own() {
    let folder = Folder::new("numbers", ROBOT);
    let links = |pairs: &[(&str, usize)]| PerLink {
        common: 6,
        links: pairs.iter().map(|(name, most)| ((*name).to_owned(), *most)).collect(),
    };
    let robot = folder.spherize(&SphereOptions { most: links(&[("tip", 9)]), ..options(1) }).unwrap();
    assert_eq!(robot.links.iter().map(|link| link.spheres.len()).collect::<Vec<_>>(), [6, 9]);
    let refused = |options: SphereOptions| folder.spherize(&options).unwrap_err().to_string();
    let error = refused(SphereOptions { most: links(&[("hand", 9)]), ..options(1) });
    assert!(error.contains("there is no link \"hand\" with collision geometry; the links are arm, tip"), "{error}");
    let error = refused(options(0));
    assert!(error.contains("0 spheres for a link; expected 1 to 10000"), "{error}");
    for coverage in [0.0, 1.1, f64::NAN] {
        let error = refused(SphereOptions { coverage: PerLink::all(Some(coverage)), ..options(8) });
        assert!(error.contains("expected a share above 0 and at most 1"), "{error}");
    }
}

/// An arm of three links in a plane and a hand without geometry between: poses by hand.
const ARM: &str = r#"<robot name="arm">
<link name="a"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>
<joint name="ab" type="revolute"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<link name="b"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>
<joint name="bm" type="fixed"><parent link="b"/><child link="m"/><origin xyz="1 0 0"/></joint>
<link name="m"/>
<joint name="mc" type="revolute"><parent link="m"/><child link="c"/><axis xyz="0 0 1"/><limit lower="0.5" upper="3" effort="1" velocity="1"/></joint>
<link name="c"><collision><origin xyz="0.9 0 0"/><geometry><sphere radius="0.3"/></geometry></collision></link>
<joint name="cd" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
<link name="d"><collision><origin xyz="0.9 0 0.1"/><geometry><sphere radius="0.2"/></geometry></collision></link>
<joint name="de" type="fixed"><parent link="d"/><child link="e"/></joint>
<link name="e"><collision><origin xyz="0.9 0 0.2"/><geometry><sphere radius="0.2"/></geometry></collision></link>
</robot>"#;

#[test]
fn pairs_that_a_planner_ignores_are_those_by_hand() {
    let folder = Folder::new("ignored", ARM);
    let robot = folder.spherize(&options(4)).unwrap();
    let pose = |pairs: &[(&str, f64)]| pairs.iter().map(|(name, q)| ((*name).to_owned(), *q)).collect();
    // places by trigonometry: b turns by q, c by p at (2, 0) of b's line, d slides by s along c
    let by_hand = |q: f64, p: f64, s: f64| {
        let b = Vec3::new(1.0, 0.0, 0.0);
        let m = b + Vec3::new(q.cos(), q.sin(), 0.0);
        let along = Vec3::new((q + p).cos(), (q + p).sin(), 0.0);
        let (c, d) = (m + 0.9 * along, m + (0.9 + s) * along);
        let up = Vec3::z();
        let spheres = [(Vec3::zeros(), 0.3), (b, 0.3), (c, 0.3), (d + 0.1 * up, 0.2), (d + 0.2 * up, 0.2)];
        let pairs = (0..5).flat_map(|k| (0..k).map(move |j| [j, k]));
        let depth = |[j, k]: [usize; 2]| spheres[j].1 + spheres[k].1 - (spheres[j].0 - spheres[k].0).norm();
        let mut found: Vec<([usize; 2], f64)> = pairs.map(|pair| (pair, depth(pair))).filter(|x| x.1 > 0.0).collect();
        found.sort_by_key(|x| x.0);
        found
    };
    for (q, p, s) in [(0.0, 0.5, 0.0), (1.2, 2.9, 0.05), (2.2, 2.5, 0.1), (-3.0, 3.0, 0.0)] {
        let found = robot.overlaps(&pose(&[("ab", q), ("mc", p), ("cd", s)])).unwrap();
        let wanted = by_hand(q, p, s);
        assert_eq!(found.iter().map(|o| o.links).collect::<Vec<_>>(), wanted.iter().map(|w| w.0).collect::<Vec<_>>());
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found.depth - wanted.1).abs() < 1e-9, "{found:?} {wanted:?}");
            assert_eq!(found.adjacent, found.links[1] == found.links[0] + 1, "{found:?}");
        }
    }
    // by default the zero pose, with the limit next to 0: c, d and e overlap, the others are adjacent
    let zero = [[0, 1], [1, 2], [2, 3], [2, 4], [3, 4]];
    let ignored = |free, samples| robot.ignored_pairs(free, samples).unwrap();
    assert_eq!(ignored(&[], &[]), zero);
    assert_eq!(robot.overlaps(&pose(&[])).unwrap(), robot.overlaps(&pose(&[("mc", 0.5)])).unwrap());
    // a pose at which the arm is folded back adds pairs
    let folded = [pose(&[("ab", 1.2), ("mc", 2.9)])];
    let mut wanted: Vec<[usize; 2]> = by_hand(1.2, 2.9, 0.0).iter().map(|x| x.0).chain(zero).collect();
    wanted.sort_unstable();
    wanted.dedup();
    assert!(wanted.len() > zero.len());
    assert_eq!(ignored(&folded, &[]), wanted);
    // samples add what overlaps at all of them, which the zero pose has already
    let samples = robot.sample_poses(50, 0);
    assert_eq!(ignored(&[], &samples), zero);
    for sample in &samples {
        assert_eq!(sample.len(), 3);
        assert!((0.5..=3.0).contains(&sample["mc"]) && (0.0..=0.1).contains(&sample["cd"]), "{sample:?}");
    }
    let error = robot.overlaps(&pose(&[("elbow", 1.0)])).unwrap_err();
    assert!(error.contains("there is no joint \"elbow\" to set; the joints are ab, mc, cd"), "{error}");
    assert!(robot.overlaps(&pose(&[("ab", f64::NAN)])).unwrap_err().contains("expected a finite number"));
}

/// End spheres whose centers are not quite at the ends, as with an angle of 1.57 instead of π/2.
#[test]
fn an_inexact_capsule_is_a_capsule() {
    let (radius, length) = (0.05, 0.15);
    let folder = Folder::new(
        "inexact",
        r#"<robot name="r"><link name="l">
<collision><origin xyz="0 0 0" rpy="1.57 0 0"/><geometry><cylinder radius="0.05" length="0.15"/></geometry></collision>
<collision><origin xyz="0 -0.075 0"/><geometry><sphere radius="0.05"/></geometry></collision>
<collision><origin xyz="0 0.075 0"/><geometry><sphere radius="0.05"/></geometry></collision></link></robot>"#,
    );
    for most in [1, 2, 8, 32, 80] {
        let link = folder.spherize(&SphereOptions { error: 1e-7, ..options(most) }).unwrap().links.remove(0);
        let deviation = 0.075 * (std::f64::consts::FRAC_PI_2 - 1.57);
        let worst = link.outward.iter().copied().fold(0.0, f64::max);
        assert!(
            worst <= chain(radius, length + 2.0 * deviation, most).max(deviation) + 1.01 * deviation,
            "{most}: {worst}"
        );
        let ends = [-0.075, 0.075]
            .map(|y| points(&TriMesh::icosphere(radius * (1.0 - 1e-12), 4), at([0.0, y, 0.0], [0.0; 3])));
        let side = points(&TriMesh::cylinder(radius, length, 360), at([0.0; 3], [1.57, 0.0, 0.0]));
        for p in ends.concat().into_iter().chain(side) {
            assert!(link.spheres.iter().any(|(c, r)| (p - c).norm() <= *r), "{most}: {p:?}");
        }
    }
}
