//! Readers of mesh files: OBJ, STL and PLY.

use crate::meshes::assert_near;
use crate::rng::Rng;
use tumble_collide::{MeshError, TriMesh, Vec3, decode_text};

#[test]
fn obj_forms_are_read() {
    let obj = "# a tetrahedron and a quad\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nv 0 0 1\nf 1/1/1 3//1 2/5\nf -4 -3 -1\nf 1 2 3 4\n";
    let mesh = TriMesh::from_obj(obj).unwrap();
    assert_eq!(mesh.vertices.len(), 4);
    assert_eq!(mesh.triangles, vec![[0, 2, 1], [0, 1, 3], [0, 1, 2], [0, 2, 3]]);
}

#[test]
fn obj_errors_name_the_line() {
    let cases = [
        ("v 0 0\n", "line 1: a vertex of fewer than 3 numbers"),
        ("v 0 0 0\nv 0 x 0\n", "line 2: `x` where a coordinate should be"),
        ("v 0 0 0\nf 1 1\n", "line 2: a face of 2 corners, but it needs at least 3"),
        ("v 0 0 0\nf 1 1 q/2\n", "line 2: `q/2` where a vertex number should be"),
        ("v 0 0 0\n\nf 1 1 0\n", "line 3: face 1 refers to vertex 0, but there are 1 vertices"),
        ("v 0 0 nan\n", "line 1: vertex 1 is (0, 0, NaN), but coordinates must be finite"),
        ("", "the mesh has no triangles; at least 4 are needed to close a solid"),
    ];
    for (obj, message) in cases {
        assert_eq!(TriMesh::from_obj(obj).unwrap_err().to_string(), message);
    }
}

fn binary_stl(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in 0..mesh.triangles.len() {
        bytes.extend([0; 12]);
        mesh.corners(t).iter().flatten().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_text_and_binary_agree_and_are_welded() {
    let mesh = TriMesh::cuboid(Vec3::new(1.0, 2.0, 3.0));
    let mut from_binary = TriMesh::from_stl(&binary_stl(&mesh)).unwrap();
    let mut lines = String::from("solid box\n");
    for t in 0..12 {
        let [a, b, c] = mesh.corners(t).map(|v| format!("vertex {} {} {:e}\n", v.x, v.y, v.z));
        lines += &format!("facet normal 0 0 0\nouter loop\n{a}{b}{c}endloop\nendfacet\n");
    }
    lines += "endsolid box\n";
    assert_eq!(TriMesh::from_stl(lines.as_bytes()).unwrap(), from_binary);
    assert_eq!(from_binary.vertices.len(), 8);
    assert_near(from_binary.check_closed().unwrap().volume, 6.0, 1e-12, "volume");
}

#[test]
fn stl_that_lies_about_its_size_is_one_clear_error() {
    let mut bytes = binary_stl(&TriMesh::cuboid(Vec3::repeat(2.0)));
    bytes[80..84].copy_from_slice(&42_949_672_u32.to_le_bytes());
    let message = TriMesh::from_stl(&bytes).unwrap_err().to_string();
    assert_eq!(message, "the STL header announces 42949672 triangles (2147483684 bytes), but the file has 684 bytes");
    assert!(matches!(TriMesh::from_stl(b"hello"), Err(MeshError::StlShort { size: 5 })));
    assert!(matches!(TriMesh::from_stl(b"solid x\nfacet\nvertex 1 2 x\n"), Err(MeshError::Syntax { line: 3, .. })));
    assert!(matches!(
        TriMesh::from_stl(b"solid x\nfacet\nvertex 1 2 3\nendfacet\n"),
        Err(MeshError::Syntax { line: 4, .. })
    ));
    let mut nan = binary_stl(&TriMesh::cuboid(Vec3::repeat(2.0)));
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(TriMesh::from_stl(&nan), Err(MeshError::NotFiniteInFace { face: 2, .. })));
}

/// Damage to any byte gives a mesh or an error, never a panic, and a mesh that passes the check has
/// a volume.
#[test]
fn damaged_files_are_read_or_refused() {
    let sphere = TriMesh::icosphere(1.0, 1);
    let mut obj: String = sphere.vertices.iter().map(|v| format!("v {:.3} {:.3} {:.3}\n", v.x, v.y, v.z)).collect();
    obj.extend(sphere.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
    let (obj, stl) = (obj.into_bytes(), binary_stl(&sphere));
    let mut rng = Rng::new(9);
    let (mut read, mut refused) = (0, 0);
    for case in 0..6000 {
        let mut bytes = if case % 2 == 0 { obj.clone() } else { stl.clone() };
        for _ in 0..1 + rng.below(4) {
            let place = rng.below(bytes.len());
            bytes[place] = if case % 4 < 2 { b"0123456789-+.e/ \nvf"[rng.below(19)] } else { rng.below(256) as u8 };
        }
        if rng.below(8) == 0 {
            bytes.truncate(rng.below(bytes.len()));
        }
        let mesh =
            if case % 2 == 0 { TriMesh::from_obj(&String::from_utf8_lossy(&bytes)) } else { TriMesh::from_stl(&bytes) };
        match mesh.and_then(|mut m| m.check_closed()) {
            Ok(report) => {
                assert!(report.volume > 0.0);
                read += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
    }
    assert!(read > 100 && refused > 1000, "{read} {refused}");
}

#[test]
fn obj_files_come_in_several_spellings() {
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let wanted = TriMesh::from_obj(plain).unwrap();
    let read = |bytes: &[u8]| TriMesh::from_obj(&decode_text(bytes).unwrap()).unwrap();
    assert_eq!(read(format!("\u{feff}{plain}").as_bytes()), wanted);
    assert_eq!(read(plain.replace('\n', "\r").as_bytes()), wanted);
    assert_eq!(read(plain.replace('\n', "\r\n").as_bytes()), wanted);
    assert_eq!(read(&[b"# caf\xe9 \xff\n", plain.as_bytes()].concat()), wanted);
    assert_eq!(read(plain.replace("1 3 2", "1 \\\n3 \\\r\n 2").as_bytes()), wanted);
    assert_eq!(read(format!("# ends in \\\n{plain}").as_bytes()), wanted);
    // line numbers are those of the file; a continued line has the first one's
    let (_, lines) = TriMesh::from_obj_with_lines(&plain.replace("1 3 2", "1 \\\n3 2")).unwrap();
    assert_eq!(lines, [5, 7, 8, 9]);
    assert_eq!(decode_text(b"v 0\0"), Err(3));
}

#[test]
fn stl_text_may_be_in_capitals() {
    let text = "solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid\n".to_owned() + &" ".repeat(80);
    let wanted = TriMesh::from_stl(text.as_bytes()).unwrap();
    assert_eq!(wanted.triangles.len(), 1);
    for other in [text.to_uppercase(), text.replace('\n', "\r"), format!("\u{feff}{text}")] {
        assert_eq!(TriMesh::from_stl(other.as_bytes()).unwrap(), wanted);
    }
}

/// Returns a box of six quads as PLY, with an unknown property and element.
fn ply(encoding: &str, corners: &[[f32; 3]], quads: &[[i32; 4]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\ncomment made here\nelement vertex {}\nproperty float x\nproperty float y\nproperty uchar red\nproperty float z\n\
         element edge 1\nproperty int vertex1\nproperty list uchar double weights\nelement face {}\nproperty list uchar int vertex_indices\nproperty short group\nend_header\n",
        corners.len(), quads.len()
    )
    .into_bytes();
    let swap = encoding == "binary_big_endian";
    let mut put = |little: &[u8], word: String| match encoding {
        "ascii" => bytes.extend(format!("{word} ").bytes()),
        _ if swap => bytes.extend(little.iter().rev()),
        _ => bytes.extend(little),
    };
    for [x, y, z] in corners {
        put(&x.to_le_bytes(), x.to_string());
        put(&y.to_le_bytes(), y.to_string());
        put(&[200], "200".into());
        put(&z.to_le_bytes(), z.to_string());
    }
    put(&7_i32.to_le_bytes(), "7".into());
    put(&[2], "2".into());
    [0.5_f64, -1.5].iter().for_each(|w| put(&w.to_le_bytes(), w.to_string()));
    for quad in quads {
        put(&[4], "4".into());
        quad.iter().for_each(|k| put(&k.to_le_bytes(), k.to_string()));
        put(&(-3_i16).to_le_bytes(), "-3".into());
    }
    bytes
}

/// Reads the file with each byte replaced in turn: an error or a mesh, and no panic.
fn read_with_one_byte_changed(bytes: &[u8]) {
    for at in 0..bytes.len() {
        for with in [0, 9, b'-', b'9', 0xff] {
            let mut bytes = bytes.to_vec();
            bytes[at] = with;
            let _ = TriMesh::from_ply(&bytes);
        }
    }
}

#[test]
fn ply_is_read_in_all_three_encodings() {
    let corners: Vec<[f32; 3]> =
        (0..8).map(|k| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 1.5 } else { -0.25 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = ply(encoding, &corners, &quads);
        let mut mesh = TriMesh::from_ply(&bytes).unwrap();
        assert_eq!(
            (mesh.vertices.len(), mesh.triangles.len(), mesh.triangles[..2].to_vec()),
            (8, 12, vec![[0, 2, 3], [0, 3, 1]]),
            "{encoding}"
        );
        assert_near(mesh.check_closed().unwrap().volume, 1.75_f64.powi(3), 1e-12, encoding);
        // a truncated file is an error that says so, and one with other bytes is an error or a mesh
        for end in 0..bytes.len() - 1 {
            assert!(TriMesh::from_ply(&bytes[..end]).is_err() || encoding == "ascii", "{encoding} cut at {end}");
        }
        read_with_one_byte_changed(&bytes);
    }
}

#[test]
fn ply_errors_name_the_place() {
    let good = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(TriMesh::from_ply(good.as_bytes()).unwrap().triangles, [[0, 1, 2]]);
    assert_eq!(TriMesh::from_ply(good.replace('\n', "\r\n").as_bytes()).unwrap().triangles, [[0, 1, 2]]);
    let cases = [
        ("ply\n", "plx\n", "line 1: expected `ply`"),
        ("ascii 1.0", "hex 1.0", "line 2: the format `hex`; expected ascii"),
        ("vertex 3", "vertex 99999999999999999", "vertex 5: the file ends before it"),
        ("float y", "float q", "the element `vertex`: expected properties x, y and z"),
        ("float y", "real y", "line 5: `real` is not a number type"),
        ("vertex_index", "corners", "the element `face`: expected `property list"),
        ("end_header\n", "", "line 9: `0` where format, element"),
        ("1 0 0", "1 a 0", "vertex 2: `a` where a number should be"),
        ("3 0 1 2", "2 0 1", "face 1: 2 corners, but it needs at least 3"),
        ("3 0 1 2", "3 0 1 3", "face 1 refers to vertex 4, but there are 3 vertices"),
        ("3 0 1 2", "3 0 1 -1", "face 1 refers to vertex 0, but there are 3 vertices"),
        ("3 0 1 2", "3 0 1 1.5", "face 1: 1.5 where the number of a vertex should be"),
        ("3 0 1 2", "-3 0 1 2", "face 1: a list of -3 numbers"),
        ("1 0 0", "1 nan 0", "vertex 2 is (1, NaN, 0), but coordinates must be finite"),
    ];
    for (from, to, said) in cases {
        let error = TriMesh::from_ply(good.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(said), "{from} → {to}: {error}");
    }
}

/// Returns a tetrahedron as one strip of six, in the given encoding.
fn ply_of_strips(encoding: &str, strips: &[&[i32]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element tristrips {}\nproperty list int int vertex_indices\nend_header\n",
        strips.len()
    )
    .into_bytes();
    let mut put = |little: [u8; 4], word: String| match encoding {
        "ascii" => bytes.extend(format!("{word} ").bytes()),
        "binary_big_endian" => bytes.extend(little.iter().rev()),
        _ => bytes.extend(little),
    };
    for x in [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].as_flattened() {
        put((*x as f32).to_le_bytes(), x.to_string());
    }
    for strip in strips {
        put((strip.len() as i32).to_le_bytes(), strip.len().to_string());
        strip.iter().for_each(|v| put(v.to_le_bytes(), v.to_string()));
    }
    bytes
}

/// For any division into strips, the tetrahedron has four outward-wound faces and a sixth of a
/// cube's volume.
#[test]
fn ply_triangle_strips_are_read() {
    let cases: [&[&[i32]]; 5] = [
        // 0 2 1, then 1 2 3 by its turn, then 1 3 0, then 0 3 2
        &[&[0, 2, 1, 3, 0, 2]],
        &[&[0, 2, 1, 3, -1, 1, 3, 0, 2]],
        &[&[0, 2, 1, -1, 1, 2, 3, -1, 1, 3, 0, -1, 0, 3, 2, -1]],
        &[&[0, 2, 1, 3], &[-1, 1, 3, 0, 2, -1, -1]],
        // repeated vertices lead from one strip to the next without a restart
        &[&[0, 2, 1, 3, 3, 1, 1, 3, 0, 2]],
    ];
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for strips in cases {
            let mesh = TriMesh::from_ply(&ply_of_strips(encoding, strips)).unwrap();
            assert_eq!(mesh.triangles.len(), 4, "{encoding} {strips:?}");
            let report = mesh.clone().check_closed().unwrap();
            assert_eq!((report.flipped_faces, report.turned, report.notes()), (0, false, vec![]), "{strips:?}");
            assert_near(mesh.signed_volume(), 1.0 / 6.0, 1e-15, encoding);
        }
        let bytes = ply_of_strips(encoding, cases[2]);
        for end in 0..bytes.len() - 1 {
            assert!(TriMesh::from_ply(&bytes[..end]).is_err(), "{encoding} cut at {end}");
        }
        read_with_one_byte_changed(&bytes);
    }
}

#[test]
fn ply_errors_of_strips_name_the_place() {
    let said = |strips: &[&[i32]]| TriMesh::from_ply(&ply_of_strips("ascii", strips)).unwrap_err().to_string();
    let there = "there are 4 vertices";
    assert!(
        said(&[&[0, 2, 1, 3], &[0, 1, 4]])
            .contains(&format!("tristrips 2: it refers to vertex 4 (from 0), but {there}"))
    );
    assert!(said(&[&[0, 2, -2, 3]]).contains(&format!("tristrips 1: it refers to vertex -2 (from 0), but {there}")));
    assert!(said(&[&[0, 2, 1, -1, 0, 1]]).contains("tristrips 1: a strip of 2 vertices, but it needs at least 3"));
    assert!(said(&[&[0, 1, 1]]).contains("expected elements `face` or `tristrips`; found: 4 vertex, 1 tristrips"));
    let text = String::from_utf8(ply_of_strips("ascii", &[&[0, 2, 1, 3]])).unwrap();
    let cases = [
        ("vertex_indices", "corners", "the element `tristrips`: expected `property list … vertex_indices`"),
        ("4 0 2 1 3", "2000000000 0 2 1 3", "tristrips 1: a list of 2000000000 numbers"),
        ("4 0 2 1 3", "1000000000 0 2 1 3", "tristrips 1: the file ends before it"),
        ("4 0 2 1 3", "4 0 2 1 0.5", "tristrips 1: 0.5 where the number of a vertex should be"),
        ("tristrips 1", "tristrips 99999999999", "tristrips 2: the file ends before it"),
        ("tristrips", "trifans", "expected elements `face` or `tristrips`; found: 4 vertex, 1 trifans"),
    ];
    for (from, to, said) in cases {
        let error = TriMesh::from_ply(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(said), "{from} → {to}: {error}");
    }
}
