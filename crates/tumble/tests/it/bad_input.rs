//! Bad input: exit code 2, and one clear message that names the file, the line or the value;
//! nothing panics.

use crate::common::*;

/// Faults, and the words that each message must contain besides the file's name.
fn table() -> Vec<(&'static str, String, Vec<&'static str>)> {
    let bare = |body: &str| format!("[[body]]\nname = \"b\"\n{body}\n");
    vec![
        ("unknown key", scene("collor = \"#ffffff\"", ""), vec![":8:", "collor", "color"]),
        ("unknown table", scene("", "[wurld]\n"), vec![":9:", "wurld"]),
        ("duplicate name", scene("", "[[body]]\nname = \"ball\"\nmode = \"static\"\nshape = { type = \"half_space\" }"), vec!["ball", ":10:"]),
        ("negative friction", scene("friction = -0.5", ""), vec![":8:", "friction", "-0.5"]),
        ("restitution above 1", scene("restitution = 1.5", ""), vec![":8:", "restitution", "1.5"]),
        ("zero mass", bare("shape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 0"), vec![":4:", "mass_kg", "0"]),
        ("negative mass", bare("shape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = -1.0"), vec![":4:", "mass_kg", "-1"]),
        ("NaN mass", bare("shape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = nan"), vec![":4:", "mass_kg"]),
        ("infinite position", scene("position_m = [0, inf, 0]", ""), vec![":8:", "position_m"]),
        ("NaN velocity", scene("velocity_m_per_s = [nan, 0, 0]", ""), vec![":8:", "velocity_m_per_s"]),
        ("wrong type", scene("friction = \"much\"", ""), vec![":8:", "friction", "a string", "0 to 100"]),
        ("two numbers for three", scene("position_m = [0, 1]", ""), vec![":8:", "position_m"]),
        ("zero radius", bare("shape = { type = \"sphere\", radius_m = 0 }\nmass_kg = 1"), vec![":3:", "radius_m"]),
        ("unknown shape", bare("shape = { type = \"teapot\" }\nmass_kg = 1"), vec![":3:", "teapot"]),
        ("unknown stepper", "[world]\nstepper = \"warp\"\n".into(), vec![":2:", "warp", "backtracking"]),
        ("unknown solver", "[world]\nsolver = \"magic\"\n".into(), vec![":2:", "magic", "gauss_seidel"]),
        ("zero dt", "[world]\ndt_s = 0\n".into(), vec![":2:", "dt_s"]),
        ("not TOML", "[world\n".into(), vec![":1:"]),
        ("a million balls", "[[grid]]\nname = \"b\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1\ncount = [1000, 1000, 1000]\nspacing_m = [1, 1, 1]\n".into(), vec![":5:", "count"]),
        ("missing mesh", format!("[meshes.m]\ntype = \"file\"\nfile = \"nowhere.obj\"\n{}", bare("shape = { type = \"mesh\", mesh = \"m\" }\nmass_kg = 1")), vec!["nowhere.obj"]),
        ("unknown mesh", bare("shape = { type = \"mesh\", mesh = \"m\" }\nmass_kg = 1"), vec![":3:", "m"]),
    ]
}

#[test]
fn every_bad_scene_gets_one_clear_message() {
    let folder = Folder::new("bad-scenes");
    for (i, (what, toml, words)) in table().into_iter().enumerate() {
        let file = format!("bad{i}.toml");
        let path = folder.write(&file, &toml);
        for verb in ["check", "run"] {
            let said = fail(&[verb, &path], 2);
            for word in words.iter().chain([&file.as_str()]) {
                assert!(said.contains(word), "{what} ({verb}): '{word}' is not in: {said}");
            }
        }
    }
}

/// Bytes that are not text, or text that is not TOML: one message per fault that the parser finds,
/// all about one file.
#[test]
fn garbage_is_no_scene() {
    let folder = Folder::new("garbage");
    for (file, bytes) in [
        ("binary.toml", vec![0xff, 0xfe, 0x00, 0x80]),
        ("control.toml", vec![0, 1, 2, 3]),
        ("deep.toml", [b"a = ".to_vec(), vec![b'['; 100_000]].concat()),
    ] {
        let said = fail_often(&["run", &folder.write(file, bytes)], 2);
        assert!(said.contains(file), "{file}: {said}");
    }
}

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

#[test]
fn every_bad_mesh_gets_one_clear_message() {
    let folder = Folder::new("bad-meshes");
    let mut two_gigabytes = vec![0u8; 84];
    two_gigabytes[80..].copy_from_slice(&42_949_672u32.to_le_bytes()); // 50 bytes each: 2 GB
    let mut nan_stl = vec![0u8; 84 + 4 * 50];
    nan_stl[80] = 4;
    nan_stl[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let table: Vec<(&str, Vec<u8>, &str)> = vec![
        ("open.obj", TETRAHEDRON.replace("f 1 4 3\n", "").into(), "open"),
        ("nan.obj", TETRAHEDRON.replace("v 1 0 0", "v nan 0 0").into(), "line 2"),
        ("infinite.obj", TETRAHEDRON.replace("v 1 0 0", "v 1e400 0 0").into(), "line 2"),
        ("beyond.obj", TETRAHEDRON.replace("f 1 3 2", "f 1 3 9").into(), "line 5"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n".into(), "flat.obj"),
        ("empty.obj", Vec::new(), "empty.obj"),
        ("empty.stl", Vec::new(), "empty.stl"),
        ("garbage.obj", (0u16..4096).map(|i| (i.wrapping_mul(197) >> 3) as u8).collect(), "garbage.obj"),
        ("garbage.stl", (0u16..4096).map(|i| (i.wrapping_mul(197) >> 3) as u8).collect(), "garbage.stl"),
        ("huge.stl", two_gigabytes, "42949672"),
        ("nan.stl", nan_stl, "nan.stl"),
    ];
    for (file, bytes, word) in table {
        let path = folder.write(file, bytes);
        let said = fail(&["check", &path], 2);
        assert!(said.contains(file) && said.contains(word), "{file}: '{word}' is not in: {said}");
        let mesh = format!(
            "[meshes.m]\ntype = \"file\"\nfile = \"{file}\"\n[[body]]\nname = \"b\"\nshape = {{ type = \"mesh\", mesh = \"m\" }}\nmass_kg = 1.0\n"
        );
        let said = fail(&["run", &folder.write("uses.toml", mesh)], 2);
        assert!(said.contains(file), "the scene that uses {file} does not name it: {said}");
    }
}

#[test]
fn bad_usage_and_failure_have_different_exit_codes() {
    let folder = Folder::new("bad-usage");
    let here = text(&folder.path("."));
    for (args, word) in [
        (&["run", "no_such_scene"][..], "no_such_scene"),
        (&["run", "/nonexistent/scene.toml"], "/nonexistent/scene.toml"),
        (&["check", "/nonexistent/mesh.obj"], "/nonexistent/mesh.obj"),
        (&["run", &here], "scene.toml"),
        (&["check", &here], "scene.toml"),
        (&["run", "stack", "--stepper", "warp"], "warp"),
        (&["run", "stack", "--solver", "magic"], "magic"),
        (&["run", "stack", "--integrator", "euler"], "euler"),
        (&["run", "stack", "--duration", "nan"], "nan"),
        (&["run", "stack", "--duration", "-1"], "-1"),
        (&["run", "stack", "--duration", "inf"], "inf"),
        (&["run", "stack", "--dt", "0"], "0"),
        (&["run", "stack", "--dt", "soon"], "soon"),
        (&["run", "stack", "--size", "0x0"], "0x0"),
        (&["run", "stack", "--size", "99999999x99999999"], "99999999x99999999"),
        (&["run", "stack", "--size", "big"], "big"),
        (&["run", "stack", "--size", "16384x16384"], "together at most 33554432"),
        (&["run", "stack", "--debug-draw", "ghosts"], "ghosts"),
        (&["run", "stack", "--speed", "3"], "--speed"),
        (&["run"], "SCENE"),
        (&["check"], "FILES"),
        (&["dance"], "dance"),
    ] {
        let said = fail(args, 2);
        assert!(said.contains(word), "tumble {args:?}: '{word}' is not in: {said}");
    }
}

#[test]
fn a_damaged_or_foreign_snapshot_is_bad_input() {
    let folder = Folder::new("bad-snapshots");
    let (saved, quiet) = (text(&folder.path("stack.state")), "--quiet");
    succeed(&["run", "stack", "--duration", "0.1", quiet, "--save", &saved]);
    let bytes = std::fs::read(&saved).unwrap();
    let mut wrong_magic = bytes.clone();
    wrong_magic[0] ^= 1;
    let mut not_finite = bytes.clone();
    not_finite[8..16].copy_from_slice(&f64::NAN.to_le_bytes()); // the time follows the magic number
    for (file, bytes) in [
        ("empty", Vec::new()),
        ("cut", bytes[..bytes.len() / 2].to_vec()),
        ("magic", wrong_magic),
        ("nan", not_finite),
        ("garbage", vec![0xff; 1000]),
    ] {
        let said = fail(&["run", "stack", "--duration", "0.1", quiet, "--restore", &folder.write(file, bytes)], 2);
        assert!(said.contains(file) && said.contains("snapshot"), "{file}: {said}");
    }
    let said = fail(&["run", "incline", "--duration", "0.1", quiet, "--restore", &saved], 2);
    assert!(said.contains("another world") && said.contains("crate_1"), "{said}");
    fail(&["run", "stack", "--restore", "/nonexistent/state"], 2);
    #[cfg(target_os = "linux")]
    assert!(
        fail(&["run", "stack", "--restore", "/dev/zero"], 2).contains("larger than"),
        "what never ends is read to its end"
    );
}

#[test]
fn what_cannot_be_written_is_a_failure_at_run_time() {
    let folder = Folder::new("unwritable");
    let file = folder.write("file", "in the way");
    let below = format!("{file}/out");
    for option in ["--summary", "--record", "--save"] {
        let said = fail(&["run", "stack", "--duration", "0.02", "--quiet", option, &below], 1);
        assert!(said.contains(&below), "{option}: {said}");
    }
    // known faults are reported before a run of eleven days begins
    for option in ["--summary", "--save", "--screenshot", "--video"] {
        let said = fail(&["run", "stack", "--duration", "1e6", "--quiet", option, &text(&folder.path("."))], 1);
        assert!(said.contains("it is a folder"), "{option}: {said}");
        let said = fail(&["run", "stack", "--duration", "1e6", "--quiet", option, "/nonexistent/out"], 1);
        assert!(said.contains("there is no folder /nonexistent"), "{option}: {said}");
    }
}

/// A full disk, by Linux's device for it.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure_at_run_time() {
    for option in ["--summary", "--record", "--save"] {
        let said = fail(&["run", "stack", "--duration", "0.02", "--quiet", option, "/dev/full"], 1);
        assert!(said.contains("/dev/full") && said.contains("No space left"), "{option}: {said}");
    }
    for args in [&["run", "stack", "--duration", "0.02"][..], &["scenes"], &["check", "stack"]] {
        let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let out = command(args).stdout(full()).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{args:?}: {said}");
        assert!(said.contains("error: stdout: No space left") && !said.contains("panicked"), "{args:?}: {said}");
        assert!(
            command(args).stdout(full()).stderr(full()).output().unwrap().status.code() == Some(1),
            "{args:?}: no stream for the message"
        );
    }
}

/// A reader may close the pipe before the end.
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    use std::io::Read;
    let mut child = command(&["check", "stack", "billiards", "incline", "cube4"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!((child.wait().unwrap().code(), said.as_str()), (Some(0), ""));
}
