//! Robots and meshes opened directly: on a floor, simulated, checked; and files that are refused.

use crate::common::*;
use std::fs::File;

/// A box of 0.2 x 0.2 x 1 m and 3 kg on a revolute joint 2 m above the origin; the box reaches down
/// to 1 m.
fn pendulum(shape: &str) -> String {
    format!(
        r#"<robot name="pendulum"><link name="world"/>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="3"/><inertia ixx="0.26" iyy="0.26" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<{shape}><origin xyz="0 0 -0.5"/><geometry><box size="0.2 0.2 1"/></geometry></{shape}></link>
<joint name="hinge" type="revolute"><parent link="world"/><child link="rod"/><origin xyz="0 0 2"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="100" velocity="10"/></joint></robot>"#
    )
}

/// A box of 1 kg without a joint.
const CRATE: &str = r#"<robot name="crate"><link name="crate"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link></robot>"#;

/// A cube in the first octant, with a corner at the origin.
fn cube(edge: u32) -> String {
    let corners = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"];
    let vertices: String = corners.iter().map(|c| format!("v {}\n", c.replace('1', &edge.to_string()))).collect();
    vertices + "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
}

fn summary(folder: &Folder, args: &[&str]) -> serde_json::Value {
    let path = text(&folder.path("summary.json"));
    succeed(&[&["run"], args, &["--quiet", "--summary", &path]].concat());
    json(&folder.path("summary.json"))
}

#[test]
fn a_urdf_stands_on_a_floor_through_its_lowest_point() {
    let folder = Folder::new("open-urdf");
    for shape in ["collision", "visual"] {
        let path = folder.write("p.urdf", pendulum(shape));
        let run = summary(&folder, &[&path, "--duration", "0.5"]);
        let floor = run["bodies"].as_array().unwrap().iter().find(|b| b["name"] == "floor").unwrap();
        assert!((floor["position_m"][2].as_f64().unwrap() - 1.0).abs() < 1e-12, "{shape}: {floor}");
        // the pendulum is in its rest position
        assert!(run["end"]["kinetic_energy_j"].as_f64().unwrap() < 1e-12, "{run}");
    }
    let said = succeed(&["run", &folder.write("p.urdf", pendulum("visual")), "--duration", "0"]);
    assert!(said.contains("--floating makes it float"), "{said}");
}

#[test]
fn a_root_that_floats_falls_as_free_bodies_do() {
    let folder = Folder::new("open-floating");
    let path = folder.write("crate.urdf", CRATE);
    let fall = summary(&folder, &[&path, "--floating", "--duration", "0.5"]);
    let speed = 9.81 * 0.5;
    assert!((fall["end"]["kinetic_energy_j"].as_f64().unwrap() - 0.5 * speed * speed).abs() < 1e-9, "{fall}");
    // a robot without joints is fixed by default, like any other
    assert!(succeed(&["check", &path]).contains("0 degrees of freedom on a fixed base"));
    let path = folder.write("p.urdf", pendulum("visual"));
    assert!(succeed(&["check", &path]).contains("1 degrees of freedom on a fixed base"));
    let mass = "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
    let heavy = format!("<link name=\"world\">{mass}</link>");
    let path = folder.write("q.urdf", pendulum("visual").replace("<link name=\"world\"/>", &heavy));
    assert!(succeed(&["check", &path, "--floating"]).contains("7 degrees of freedom on a floating base"));
}

/// A mesh of 1000 kg/m³ falls by a tenth of its diagonal and comes to rest: `m g h` is lost.
#[test]
fn a_mesh_falls_on_a_floor() {
    let folder = Folder::new("open-mesh");
    let path = folder.write("cube.obj", cube(1));
    let run = summary(&folder, &[&path, "--duration", "5"]);
    let lost =
        run["start"]["potential_energy_j"].as_f64().unwrap() - run["end"]["potential_energy_j"].as_f64().unwrap();
    let wanted = 1000.0 * 9.81 * 0.1 * 3f64.sqrt();
    assert!((lost / wanted - 1.0).abs() < 1e-3, "{lost} J lost, {wanted} J expected");
    assert!(run["end"]["kinetic_energy_j"].as_f64().unwrap() < 1e-6, "{run}");
    let names: Vec<&str> = run["bodies"].as_array().unwrap().iter().filter_map(|b| b["name"].as_str()).collect();
    assert_eq!(names, ["floor", "cube"]);
    assert!(succeed(&["check", &path]).contains("a closed mesh of 12 triangles, volume 1.000000e0"));
}

/// A cube about the origin falls freely, so its energy stays 0 J to rounding.
#[test]
fn an_energy_that_rounds_to_zero_has_no_sign() {
    let folder = Folder::new("open-centered");
    let [low, high] = ["-0.35", "0.35"];
    let centered = |line: &str| match line.strip_prefix("v ") {
        Some(corner) => format!(
            "v {}\n",
            corner.split(' ').map(|x| if x == "0" { low } else { high }).collect::<Vec<_>>().join(" ")
        ),
        None => format!("{line}\n"),
    };
    let path = folder.write("cube.obj", cube(1).lines().map(centered).collect::<String>());
    let said = succeed(&["run", &path, "--duration", "0.1"]);
    assert!(said.contains("energy 0.000000 J at the start, 0.000000 J at the end"), "{said}");
}

#[test]
fn a_mesh_of_hundreds_of_meters_is_noted() {
    let folder = Folder::new("open-large");
    let path = folder.write("part.obj", cube(100));
    let said = succeed(&["run", &path, "--duration", "0"]);
    assert!(said.contains("diagonal is 173.2 m") && said.contains("millim"), "{said}");
    assert!(!succeed(&["run", &folder.write("cube.obj", cube(1)), "--duration", "0"]).contains("millim"));
}

#[test]
fn an_open_mesh_is_refused_and_repaired_where_asked() {
    let folder = Folder::new("open-repair");
    let path = folder.write("open.obj", cube(1).replace("f 4 1 5 8\n", ""));
    assert!(fail(&["run", &path, "--duration", "0"], 2).contains("open.obj"));
    assert!(succeed(&["run", &path, "--duration", "0", "--repair"]).contains("open.obj"));
}

#[test]
fn files_that_are_no_scenes_give_one_message() {
    let folder = Folder::new("no-scenes");
    let off = "OFF\n8 6 0\n".to_owned() + &"0.5 0.5 0.5\n".repeat(200);
    let many = "this is = = no toml\n".repeat(300);
    let table: [(&str, Vec<u8>, &str); 9] = [
        ("x.off", off.clone().into(), "the mesh format .off is not supported"),
        ("x.glb", vec![0x67, 0x6c, 0x54, 0x46, 2, 0, 0, 0], ".glb is not supported"),
        ("X.FBX", vec![0; 100], ".fbx is not supported"),
        ("x.xacro", b"<robot/>".to_vec(), "xacro NAME.xacro > NAME.urdf"),
        ("x.sdf", b"<sdf/>".to_vec(), "<sdf> has no <model>"),
        ("x.bin", vec![b'a', 0, b'b'], "byte 1 of the file is 0"),
        ("x.txt", many.into(), "more syntax errors follow"),
        ("off", off.into(), "more syntax errors follow"),
        ("x.png", vec![0x89, b'P', b'N', b'G', 13, 10, 26, 10], "x.png"),
    ];
    for (name, bytes, words) in table {
        let path = folder.write(name, bytes);
        for verb in ["check", "run", "view"] {
            let said = fail(&[verb, &path], 2);
            assert!(said.contains(words) && said.contains(name), "{verb} {name}: {said}");
        }
    }
    assert!(fail(&["run", "nowhere.glb"], 2).contains(".glb"));
}

#[test]
fn robots_and_meshes_that_cannot_be_read_give_one_message() {
    let folder = Folder::new("bad-opening");
    let huge = |name: &str, bytes: u64| {
        File::create(folder.path(name)).unwrap().set_len(bytes).unwrap();
        text(&folder.path(name))
    };
    let directory = |name: &str| {
        std::fs::create_dir_all(folder.path(name)).unwrap();
        text(&folder.path(name))
    };
    let missing_mesh = pendulum("collision").replace("<box size=\"0.2 0.2 1\"/>", "<mesh filename=\"gone.stl\"/>");
    let table = [
        ("nowhere.urdf".to_owned(), "nowhere.urdf: cannot read"),
        ("nowhere.obj".to_owned(), "nowhere.obj"),
        (folder.write("broken.urdf", "<robot name=\"r\">\n<link name=\"a\">\n</robot>"), "broken.urdf:3:"),
        (folder.write("other.urdf", "<model/>"), "expected <robot>"),
        (folder.write("gone.urdf", missing_mesh), "gone.stl"),
        (folder.write("empty.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "empty.obj"),
        (folder.write("empty.stl", ""), "empty.stl"),
        (folder.write("line.obj", "v 0 0 0\nv 1 0 zero\n"), "line 2"),
        (directory("d.urdf"), "d.urdf"),
        (directory("d.obj"), "d.obj"),
        (huge("huge.urdf", (64 << 20) + 1), "larger than 67108864 bytes"),
        (huge("huge.stl", (1 << 30) + 1), "1073741824"),
    ];
    for (path, words) in &table {
        for verb in ["check", "run", "view"] {
            let said = fail(&[verb, path], 2);
            assert!(said.contains(words), "{verb} {path}: '{words}' is not in: {said}");
        }
    }
}

#[test]
fn options_of_robots_and_meshes_are_refused_elsewhere() {
    let folder = Folder::new("opening-options");
    let (cube, urdf) = (folder.write("cube.obj", cube(1)), folder.write("crate.urdf", CRATE));
    for (args, words) in [
        (&["run", "stack", "--floating"][..], "need a .urdf"),
        (&["run", &cube, "--fixed-base"], "need a .urdf"),
        (&["run", "stack", "--repair"], "--repair needs a mesh"),
        (&["run", &urdf, "--repair"], "--repair needs a mesh"),
        (&["run", &urdf, "--floating", "--fixed-base"], "--fixed-base"),
        (&["run", &urdf, "--package", "p=/nonexistent/folder"], "/nonexistent/folder"),
    ] {
        let said = fail(args, 2);
        assert!(said.contains(words), "{args:?}: {said}");
    }
}
