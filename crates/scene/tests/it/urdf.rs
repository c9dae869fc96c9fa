//! URDF: what its elements mean, and what is told of wrong ones.

use tumble_scene::urdf::{CollisionMeshes, MissingMeshes, UrdfModel, UrdfOptions, load, parse_model};

fn read(text: &str) -> UrdfModel {
    parse_model(text, "r.urdf", &UrdfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn all_real() {
    let mut files: Vec<_> = walk(std::path::Path::new("/tmp/pinenv/lib/python3.11/site-packages/cmeel.prefix/share/example-robot-data"));
    files.sort();
    for f in files {
        match tumble_scene::urdf::model(&f, &UrdfOptions { floating: true, ..UrdfOptions::default() }) {
            Ok(m) => println!("{} dof {} mass {} notes {}", f.file_name().unwrap().display(), m.model.dof(), m.model.mass(), m.notes.len()),
            Err(e) => println!("ERR {e}"),
        }
    }
    let _ = read;
}

fn walk(dir: &std::path::Path) -> Vec<std::path::PathBuf> {
    let mut out = vec![];
    for e in std::fs::read_dir(dir).unwrap() {
        let p = e.unwrap().path();
        if p.is_dir() { out.extend(walk(&p)) } else if p.extension().is_some_and(|x| x == "urdf") { out.push(p) }
    }
    out
}
#[test]
fn load_some() {
    for f in ["panda_description/urdf/panda.urdf", "talos_data/robots/talos_reduced.urdf", "anymal_b_simple_description/robots/anymal.urdf"] {
        for hull in [CollisionMeshes::Exact, CollisionMeshes::Hull] {
            let t = std::time::Instant::now();
            let p = std::path::Path::new("/tmp/pinenv/lib/python3.11/site-packages/cmeel.prefix/share/example-robot-data/robots").join(f);
            let o = UrdfOptions { collision_meshes: hull, missing_meshes: MissingMeshes::Error, ..UrdfOptions::default() };
            match load(&p, &o) {
                Ok((b, notes)) => { println!("{f} {hull:?} {:?} dof {} notes:", t.elapsed(), b.model().dof()); for n in notes { println!("   {n}"); } }
                Err(e) => println!("ERR {e}"),
            }
        }
    }
}
