//! `tumble check --repair`: meshes that are not solids become solids, and notes list the repairs.

use crate::common::*;

const OPEN: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";

#[test]
fn an_open_mesh_is_closed_on_request_and_the_file_stays() {
    let folder = Folder::new("repair");
    let path = folder.write("open.obj", OPEN);
    let said = fail(&["check", &path], 2);
    assert!(said.contains("open.obj") && said.contains("line 5") && said.contains("face 1"), "{said}");
    let said = succeed(&["check", "--repair", &path]);
    assert!(
        said.contains("1 hole(s) were filled with 1 faces") && said.contains("a closed mesh of 4 triangles"),
        "{said}"
    );
    assert_eq!(std::fs::read_to_string(&path).unwrap(), OPEN);
    // no hole can be closed
    let said = fail(&["check", "--repair", &folder.write("lone.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")], 2);
    assert!(said.contains("line 4") && said.contains("repair failed:"), "{said}");
}

/// Every public bad mesh ends within a minute, with success or one message, with and without
/// repair.
#[test]
fn public_bad_meshes_end_in_success_or_one_message() {
    let given = std::env::var_os("TUMBLE_MESHES").map(std::path::PathBuf::from);
    let here = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let found = given.or_else(|| here.ancestors().map(|a| a.join("shared/meshes")).find(|p| p.is_dir()));
    let Some(folder) = found else {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: no shared/meshes and TUMBLE_MESHES is not set\n"),
        );
        return;
    };
    let accepted = ["nonmanifold_edge", "self_intersecting", "degenerate", "flipped_some", "inside_out", "dup_shell"];
    let mended = ["open_hole", "nonmanifold_fin"];
    let refused = ["nan_vertex", "inf_vertex", "index_out_of_range", "flat", "empty"];
    let check = |name: &str, repair: bool| {
        let path = text(&folder.join(format!("bad/{name}.obj")));
        let args: Vec<&str> =
            ["check"].into_iter().chain(repair.then_some("--repair")).chain([path.as_str()]).collect();
        let (good, begun) = (accepted.contains(&name) || (repair && mended.contains(&name)), std::time::Instant::now());
        let said = if good { succeed(&args) } else { fail(&args, 2) };
        assert!(said.contains(name) && said.lines().count() >= if good { 2 } else { 1 }, "{name}: {said}");
        assert!(begun.elapsed().as_secs() < 60, "{name} took {:?}", begun.elapsed());
    };
    for name in accepted.iter().chain(&mended).chain(&refused) {
        check(name, false);
        check(name, true);
    }
}
