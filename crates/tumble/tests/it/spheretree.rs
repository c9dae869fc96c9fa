//! `tumble spheretree`: tables, files, pictures, the cache under several processes, robots, and
//! errors.

use crate::common::*;
use serde_json::Value;
use tumble::collide::{SphereTree, TreeFile, TreeSettings, TriMesh};

fn obj(mesh: &TriMesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    vertices.chain(faces).collect()
}

fn ring() -> TriMesh {
    TriMesh::torus(1.0, 0.3, 16, 8)
}

/// Options for a quick tree.
const QUICK: [&str; 4] = ["--method", "octree", "--depth", "2"];

#[test]
fn the_table_and_the_file_say_what_the_library_says() {
    let folder = Folder::new("spheretree");
    let (mesh, out) = (folder.write("ring.obj", obj(&ring())), text(&folder.path("tree.json")));
    let said = succeed(&[&["spheretree", &mesh, "--no-cache", "-v", "--json", &out][..], &QUICK].concat());
    let file = TreeFile::from_json(&std::fs::read_to_string(&out).unwrap()).unwrap();
    let tree = SphereTree::build(&ring(), &TreeSettings { depth: 2, ..TreeSettings::octree() }).unwrap();
    assert_eq!((file.name.as_str(), &file.tree), ("ring.obj", &tree));
    assert_eq!(file.quality.len(), tree.levels() as usize);
    assert!(file.quality.iter().all(|q| q.coverage == 1.0 && q.nesting_broken == 0));
    for level in 0..tree.levels() {
        let row: Vec<&str> = said
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>())
            .find(|row| row.first() == Some(&level.to_string().as_str()))
            .unwrap()[..3]
            .to_vec();
        assert_eq!(row, [level.to_string(), tree.at_level(level).count().to_string(), "100.00".into()], "{said}");
    }
    assert!(said.contains("level 2: ") && said.contains("leaves"), "{said}");
    assert_eq!(succeed(&[&["spheretree", &mesh, "--no-cache", "-q"][..], &QUICK].concat()), "");
}

#[test]
fn many_processes_share_a_cache_and_all_write_the_same() {
    let folder = Folder::new("spheretree-cache");
    let (mesh, cache) = (folder.write("ring.obj", obj(&ring())), text(&folder.path("cache")));
    let output = |n: usize| text(&folder.path(&format!("tree{n}.json")));
    let run = |n: usize| {
        command(&[&["spheretree", &mesh, "-q", "--cache", &cache, "-o", &output(n)][..], &QUICK].concat())
            .spawn()
            .unwrap()
    };
    let children: Vec<_> = (0..6).map(run).collect();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    let first = std::fs::read(output(0)).unwrap();
    assert!((1..6).all(|n| std::fs::read(output(n)).unwrap() == first));
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 1);
    let said = succeed(&[&["spheretree", &mesh, "--cache", &cache][..], &QUICK].concat());
    assert!(said.contains("from the cache"), "{said}");
    // the environment variable is used without the option
    let mut named = command(&[&["spheretree", &mesh][..], &QUICK].concat());
    let said = String::from_utf8(named.env("TUMBLE_CACHE", &cache).output().unwrap().stdout).unwrap();
    assert!(said.contains("from the cache"), "{said}");
    let said = String::from_utf8(named.env("TUMBLE_CACHE", "OFF").output().unwrap().stdout).unwrap();
    assert!(said.contains("built in"), "{said}");
}

#[test]
fn a_damaged_file_of_the_cache_is_reported_and_built_again() {
    let folder = Folder::new("spheretree-damage");
    let (mesh, cache) = (folder.write("ring.obj", obj(&ring())), text(&folder.path("cache")));
    let words = [&["spheretree", &mesh, "--cache", &cache][..], &QUICK].concat();
    succeed(&words);
    let file = std::fs::read_dir(&cache).unwrap().next().unwrap().unwrap().path();
    let good = std::fs::read(&file).unwrap();
    std::fs::write(&file, &good[..good.len() / 2]).unwrap();
    let out = tumble(&words);
    let (said, messages) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success() && said.contains("built in") && messages.contains("is rebuilt"), "{said}{messages}");
    assert_eq!(std::fs::read(&file).unwrap(), good);
}

#[test]
fn a_picture_of_a_level_is_written() {
    let folder = Folder::new("spheretree-picture");
    let (mesh, picture) = (folder.write("ring.obj", obj(&ring())), text(&folder.path("level.png")));
    let out = tumble(
        &[
            &["spheretree", &mesh, "-q", "--no-cache", "--screenshot", &picture, "--level", "1", "--size", "64x48"][..],
            &QUICK,
        ]
        .concat(),
    );
    let messages = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{messages}");
    if messages.contains("no picture:") {
        // past the harness, which keeps what passing tests print
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no graphics adapter; {messages}\n"),
        );
        return;
    }
    assert_eq!(std::fs::read(&picture).unwrap()[16..24], [0, 0, 0, 64, 0, 0, 0, 48]);
}

#[test]
fn wrong_input_ends_with_2_and_says_what_would_be_right() {
    let folder = Folder::new("spheretree-wrong");
    let mesh = folder.write("ring.obj", obj(&ring()));
    let mut open = ring();
    open.triangles.pop();
    let open = folder.write("open.obj", obj(&open));
    let none = text(&folder.path("none.obj"));
    let level = text(&folder.path("level.png"));
    let robot = folder.write("robot.urdf", ROBOT);
    let (nowhere, here) = (text(&folder.path("nowhere/tree.json")), text(&folder.path("")));
    let bare = folder.write("bare.urdf", "<robot name=\"r\"><link name=\"a\"/></robot>");
    let gone = folder.write("gone.urdf", GONE);
    let cases: [(&[&str], &str); 26] = [
        (&[&none], "none.obj: cannot be read"),
        (&[&open], "the mesh is open: 3 edges"),
        (&[&mesh, "--method", "foo"], "unknown method foo, expected one of"),
        (&[&mesh, "--branching", "100"], "ring.obj: the branching of a sphere tree is 100, but must be 2 to 64"),
        (&[&mesh, "--depth", "0"], "the depth of a sphere tree is 0, but must be 1 to 9"),
        (&[&mesh, "--max-error", "2"], "expected a number from 0.0001 to 1"),
        (
            &[&mesh, "--method", "octree", "--depth", "2", "--screenshot", &level, "--level", "7"],
            "--level is 7; a tree with --depth 2 has at most levels 0 to 2",
        ),
        (&[], "expected a mesh or --urdf ROBOT"),
        (&[&mesh, "-o", &nowhere], "nowhere/tree.json cannot be written: there is no folder"),
        (&[&mesh, "-o", &here], "it is a folder; expected the name of a file"),
        (&["--urdf", &bare], "bare.urdf: no link has a <collision>"),
        (&["--urdf", &robot, "--package", "nodir"], "expected NAME=DIR"),
        (&["--urdf", &robot, "--missing-meshes", "maybe"], "expected error or skip"),
        (&["--urdf", &gone], "--package NAME=DIR"),
        (&["--urdf", &none], "cannot read the URDF"),
        (&["--urdf", &robot, "--planner", "xml"], "expected yaml, json, or a file that ends in .yml, .yaml or .json"),
        (&["--urdf", &robot, "--spheres", "c=4"], "there is no link \"c\" with collision geometry; the links are a, b"),
        (&["--urdf", &robot, "--spheres", "b=many"], "expected a number, or LINK=NUMBER"),
        (&["--urdf", &robot, "--coverage", "0"], "expected a share above 0 and at most 1"),
        (
            &["--urdf", &robot, "--weight", "1.5"],
            "a weight of 1.5; expected 0 (no volume outside) to 1 (full coverage)",
        ),
        (
            &["--urdf", &robot, "--weight", "c=0.5"],
            "there is no link \"c\" with collision geometry; the links are a, b",
        ),
        (&["--urdf", &robot, "--pose", "j"], "expected zero, or JOINT=POSITION"),
        (&["--urdf", &robot, "--pose", "k=1"], "there is no joint \"k\" to set; the joints are j"),
        (
            &["--urdf", &robot, "--output", "o.yaml", "--planner", "yaml"],
            "--output o.yaml: the robot of spheres is written as URDF",
        ),
        (&["--urdf", &robot, "--output", "o.json", "--planner", "json"], "A list for planners is --planner o.json"),
        (&["--urdf", &robot, "--planner", "yaml"], "needs --output, or a file such as --planner robot.yaml"),
    ];
    for (words, said) in cases {
        let messages = fail_often(&[&["spheretree", "--no-cache"], words].concat(), 2);
        assert!(messages.contains(said), "{words:?}: {messages}");
    }
    let said = succeed(&[&["spheretree", &open, "--no-cache", "--repair"][..], &QUICK].concat());
    assert!(said.contains("1 hole(s) were filled"), "{said}");
}

const GONE: &str = "<robot name=\"r\"><link name=\"a\"><collision><geometry><sphere radius=\"1\"/></geometry></collision><collision><geometry><mesh filename=\"package://parts/ring.obj\"/></geometry></collision></link></robot>";

#[test]
fn packages_are_named_and_meshes_that_are_not_there_skipped() {
    let folder = Folder::new("spheretree-packages");
    let robot = folder.write("gone.urdf", GONE);
    std::fs::create_dir(folder.path("elsewhere")).unwrap();
    folder.write("elsewhere/ring.obj", obj(&ring()));
    let package = format!("parts={}", text(&folder.path("elsewhere")));
    let said = succeed(&["spheretree", "--no-cache", "--urdf", &robot, "--package", &package, "--spheres", "9"]);
    assert!(said.contains("9 spheres"), "{said}");
    let said = succeed(&["spheretree", "--no-cache", "--urdf", &robot, "--missing-meshes", "skip"]);
    assert!(said.contains("left out") && said.contains("1 spheres"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_file_that_cannot_be_written_whole_stays_as_it_was() {
    let folder = Folder::new("spheretree-whole");
    let (mesh, out) = (folder.write("ring.obj", obj(&ring())), folder.path("tree.json"));
    std::fs::write(&out, "what was there").unwrap();
    // a limit on the size of files acts like a full disk
    let tree = text(&out);
    let words = [&["spheretree", &mesh, "--no-cache", "-o", &tree][..], &QUICK].concat();
    let run = ["-c", "trap '' XFSZ; ulimit -f 1; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_tumble")];
    let done = std::process::Command::new("sh").args(run).args(words).output().unwrap();
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    assert!(String::from_utf8_lossy(&done.stderr).contains("writing"), "{done:?}");
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "what was there");
    assert_eq!(std::fs::read_dir(folder.path("")).unwrap().count(), 2, "something was left behind");
    // a path that is no regular file is written directly
    let said = succeed(&[&["spheretree", &mesh, "--no-cache", "-q", "-o", "/dev/stdout"][..], &QUICK].concat());
    TreeFile::from_json(&said).unwrap();
}

const ROBOT: &str = r#"<robot name="two 1"><link name="a"><collision><origin xyz="0 0 0.5"/><geometry><box size="0.2 0.2 1"/></geometry></collision></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial><collision name="ball"><geometry><sphere radius="0.25"/></geometry></collision></link></robot>"#;

#[test]
fn a_robot_of_spheres_is_written_with_the_lists_for_planners() {
    let folder = Folder::new("spheretree-robot");
    let robot = folder.write("robot.urdf", ROBOT);
    let (out, yaml, list) =
        (text(&folder.path("out.urdf")), text(&folder.path("out.yml")), text(&folder.path("list.json")));
    let said = succeed(&[
        "spheretree",
        "--no-cache",
        "--urdf",
        &robot,
        "--output",
        &out,
        "--planner",
        "yaml",
        "--spheres",
        "12",
    ]);
    assert!(said.contains("100 % of the collision surface of each link is proved to lie inside"), "{said}");
    succeed(&["spheretree", "--no-cache", "-q", "--urdf", &robot, "--planner", &list, "--spheres", "12"]);
    assert!(succeed(&["check", &out]).contains("a robot of 2 links"));
    let list: Value = json(list.as_ref());
    let (a, b) = (list["a"]["spheres"].as_array().unwrap(), list["b"]["spheres"].as_array().unwrap());
    assert!(a.len() > 1 && a.len() <= 12 && list["a"]["worst"].as_f64() >= list["a"]["mean"].as_f64());
    assert_eq!(b, serde_json::json!([{"origin": [0.0, 0.0, 0.0], "radius": 0.25}]).as_array().unwrap());
    // the YAML has the same numbers in the layout of cuRobo
    let wanted: String = std::iter::once("robot: \"two 1\"\ncollision_spheres:\n".to_string())
        .chain([("a", a), ("b", b)].into_iter().flat_map(|(name, spheres)| {
            let rows = spheres.iter().map(|s| {
                let c = &s["origin"];
                format!("    - center: [{}, {}, {}]\n      radius: {}\n", c[0], c[1], c[2], s["radius"])
            });
            std::iter::once(format!("  \"{name}\":\n")).chain(rows).collect::<Vec<_>>()
        }))
        .chain([
            "self_collision_ignore:\n  \"a\": [\"b\"]\n".to_string(),
            "self_collision_buffer:\n  \"a\": 0.0\n  \"b\": 0.0\n".to_string(),
        ])
        .collect();
    let written = std::fs::read_to_string(yaml).unwrap();
    let (comments, rest): (Vec<&str>, Vec<&str>) = written.lines().partition(|line| line.trim_start().starts_with('#'));
    assert_eq!(rest.join("\n") + "\n", wanted);
    let starts = comments.iter().filter(|line| line.starts_with("  # covered 100.000 %; outside at most ")).count();
    assert_eq!([comments.len(), starts], [2, 2], "the figures of each link");
    // the corners of the box are inside: 0.1 across, 0 and 1 along
    for corner in 0..8 {
        let p = [0, 1, 2].map(|k| if corner >> k & 1 == 1 { [0.1, 0.1, 1.0][k] } else { [-0.1, -0.1, 0.0][k] });
        let gap = |s: &Value| {
            (0..3).map(|k| (p[k] - s["origin"][k].as_f64().unwrap()).powi(2)).sum::<f64>().sqrt()
                - s["radius"].as_f64().unwrap()
        };
        assert!(a.iter().any(|s| gap(s) <= 0.0), "{p:?}");
    }
}

#[test]
fn counts_coverage_and_self_collision_are_said() {
    let folder = Folder::new("spheretree-planner");
    let robot = folder.write("robot.urdf", ROBOT);
    let said = succeed(&[
        "spheretree",
        "--no-cache",
        "--urdf",
        &robot,
        "--spheres",
        "6",
        "--spheres",
        "a=3",
        "--coverage",
        "a=0.8",
        "--pose",
        "j=1",
        "--sample-poses",
        "20",
    ]);
    let row = |link: &str| {
        let line = said.lines().find(|line| line.trim_start().starts_with(&format!("{link} "))).unwrap();
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(row("a")[2], "3", "{said}");
    let covered: f64 = row("a")[6].parse().unwrap();
    assert!((80.0..100.0).contains(&covered) && row("b")[6] == "100.000", "{said}");
    assert!(said.contains("4 spheres; covered: the share by area"), "{said}");
    assert!(said.contains("pose 1: 1 pair of links overlap") && said.contains("adjacent"), "{said}");
    assert!(said.contains("0 of 20 sampled poses collide, 1 pair of links ignored"), "{said}");
}

#[test]
fn a_weight_is_said_with_its_figures() {
    let folder = Folder::new("spheretree-weight");
    let robot = folder.write("robot.urdf", ROBOT);
    let yaml = folder.path("spheres.yml").display().to_string();
    let figures = |weight: &str| -> [f64; 4] {
        let weight = format!("a={weight}");
        let words =
            ["spheretree", "--no-cache", "--urdf", &robot, "--spheres", "3", "--weight", &weight, "--planner", &yaml];
        let said = succeed(&words);
        let line = said.lines().find(|line| line.trim_start().starts_with("a ")).unwrap();
        let cells: Vec<f64> = line.split_whitespace().skip(3).map(|cell| cell.parse().unwrap()).collect();
        let [worst, mean, outside, covered] = cells[..] else { panic!("{said}") };
        // the same figures are a comment of the link
        let text = std::fs::read_to_string(&yaml).unwrap();
        let comment = format!(
            "  # covered {covered:.3} %; outside at most {worst:.2} mm, mean {mean:.2} mm, volume {outside:.2} %\n  \"a\":\n"
        );
        assert!(text.contains(&comment), "{comment}{text}");
        [worst, mean, outside, covered]
    };
    let sets = ["0", "0.5", "1"].map(figures);
    assert_eq!(sets[0][..3], [0.0; 3]);
    assert_eq!(sets[2][3], 100.0);
    for pair in sets.windows(2) {
        assert!(pair[0].iter().zip(&pair[1]).all(|(less, more)| less < more), "{sets:?}");
    }
}
