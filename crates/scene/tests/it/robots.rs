//! Robots from the Python package `example-robot-data`, compared with `urdf-rs`, which shares no
//! code with this crate.

use std::path::{Path, PathBuf};
use std::process::Command;

use tumble_core::{Joint, Settings, World};
use tumble_scene::urdf::{UrdfOptions, load, model};

/// Returns the folder `TUMBLE_ROBOTS`, else that of the package in the Python that `TUMBLE_PYTHON`
/// names (else `python3`); prints a note to stderr if there is none.
fn robots() -> Option<PathBuf> {
    let folder = std::env::var_os("TUMBLE_ROBOTS").map(PathBuf::from).or_else(|| {
        let python = std::env::var_os("TUMBLE_PYTHON").unwrap_or_else(|| "python3".into());
        let said = Command::new(python)
            .args(["-c", "import sysconfig; print(sysconfig.get_paths()['purelib'])"])
            .output()
            .ok()?;
        Some(
            Path::new(String::from_utf8(said.stdout).ok()?.trim()).join("cmeel.prefix/share/example-robot-data/robots"),
        )
    });
    let found = folder.filter(|folder| folder.is_dir());
    if found.is_none() {
        // directly to the terminal: the harness hides the output of passing tests
        let text = "\nSKIPPED: no robots; pip install example-robot-data and set TUMBLE_PYTHON, or set TUMBLE_ROBOTS to its folder `robots`\n";
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("{text}"));
    }
    found
}

/// Name, path below the folder, and degrees of freedom on a fixed base.
const ROBOTS: [(&str, &str, usize); 3] = [
    ("panda", "panda_description/urdf/panda.urdf", 9),
    ("talos", "talos_data/robots/talos_reduced.urdf", 32),
    ("anymal", "anymal_b_simple_description/robots/anymal.urdf", 12),
];

fn floating() -> UrdfOptions {
    UrdfOptions { floating: true, ..UrdfOptions::default() }
}

#[test]
fn masses_and_dofs_are_those_of_the_files() {
    let Some(robots) = robots() else { return };
    for (name, path, dof) in ROBOTS {
        let path = robots.join(path);
        let theirs = urdf_rs::read_file(&path).unwrap();
        let mass: f64 = theirs.links.iter().map(|link| link.inertial.mass.value).sum();
        let free = model(&path, &floating()).unwrap();
        assert!((free.model.mass() - mass).abs() < 1e-12 * mass, "{name}: {} {mass}", free.model.mass());
        assert_eq!(free.model.dof(), dof + 6, "{name}");
        assert_eq!(model(&path, &UrdfOptions::default()).unwrap().model.dof(), dof, "{name}");
    }
}

#[test]
fn joints_are_those_of_the_files() {
    let Some(robots) = robots() else { return };
    let folder = std::env::temp_dir().join(format!("tumble-bare-robots-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (name, path, _) in ROBOTS {
        let path = robots.join(path);
        let theirs = urdf_rs::read_file(&path).unwrap();
        // joints do not depend on shapes, which take minutes to build
        let bare = folder.join(format!("{name}.urdf"));
        std::fs::write(&bare, without_shapes(&std::fs::read_to_string(&path).unwrap())).unwrap();
        let (body, _) = load(&bare, &UrdfOptions::default()).unwrap();
        let joints = model(&path, &UrdfOptions::default()).unwrap().joints;
        assert_eq!(joints.len(), body.model().links().len());
        for (number, joint) in joints.iter().enumerate() {
            let same = theirs.joints.iter().find(|other| other.name == *joint).unwrap();
            let link = &body.model().links()[number];
            assert_eq!(link.name, same.child.link, "{name}");
            let axis = match link.joint {
                Joint::Revolute { axis } | Joint::Prismatic { axis } => axis,
                _ => panic!("{name}: {joint} is a {:?}", link.joint),
            };
            let limits = body.dofs()[link.v].limits.unwrap();
            let dynamics = same.dynamics.clone().unwrap_or_default();
            assert_eq!(axis.as_slice(), same.axis.xyz.0, "{name}: {joint}");
            assert_eq!(limits, [same.limit.lower, same.limit.upper], "{name}: {joint}");
            assert_eq!(body.dofs()[link.v].damping, dynamics.damping, "{name}: {joint}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Returns the text without visual and collision elements.
fn without_shapes(urdf: &str) -> String {
    ["visual", "collision"].into_iter().fold(urdf.to_string(), |text, element| {
        let (open, close) = (format!("<{element}"), format!("</{element}>"));
        let mut parts = text.split(&open);
        let first = parts.next().unwrap().to_string();
        parts.fold(first, |kept, part| {
            kept + part.split_once(&close).unwrap_or_else(|| panic!("a {element} does not end")).1
        })
    })
}

#[test]
fn all_files_are_read_or_their_faults_are_named() {
    let Some(robots) = robots() else { return };
    let mut read = 0;
    for path in urdf_files(&robots) {
        match model(&path, &floating()) {
            Ok(_) => read += 1,
            Err(error) => assert!(
                error.to_string().lines().all(|line| line.starts_with(&format!("{}:", path.display()))),
                "{error}"
            ),
        }
    }
    assert!(read >= 60, "{read} robots");
}

pub fn urdf_files(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    let below = |path: PathBuf| if path.is_dir() { urdf_files(&path) } else { vec![path] };
    entries.into_iter().flat_map(below).filter(|path| path.extension().is_some_and(|e| e == "urdf")).collect()
}

#[test]
fn a_panda_falls_into_its_limits_and_stays_whole() {
    let Some(robots) = robots() else { return };
    let (body, _) = load(robots.join(ROBOTS[0].1), &UrdfOptions::default()).unwrap();
    let limits: Vec<[f64; 2]> = body.dofs().iter().map(|f| f.limits.unwrap()).collect();
    let middle: Vec<f64> = limits.iter().map(|[lower, upper]| 0.5 * (lower + upper)).collect();
    let body = body.with_positions(&middle).unwrap();
    let mut world = World::new(Settings::default().with_dt(1.0 / 240.0)).unwrap();
    let id = world.add(body).unwrap();
    for _ in 0..480 {
        world.step().unwrap();
    }
    let q = &world.state_of(id).unwrap()[..limits.len()];
    for (k, [lower, upper]) in limits.iter().enumerate() {
        assert!(q[k] > lower - 1e-3 && q[k] < upper + 1e-3, "joint {k} at {}, limits {lower} to {upper}", q[k]);
    }
}
