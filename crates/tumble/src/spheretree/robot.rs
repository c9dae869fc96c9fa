//! `--urdf`: a robot whose collision geometry is spheres, and the lists of spheres that motion
//! planners read.

use crate::args::SphereTreeOptions;
use crate::atomic_file::{check_writable, write_file};
use crate::failure::Failure;
use crate::progress::WorkProgress;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tumble::collide::align_columns;
use tumble::scene::urdf::{LinkSpheres, SphereOptions, SphereRobot, UrdfOptions, spherize as cover};

/// Default number of spheres per link, at most.
const DEFAULT_MAX_SPHERES: u32 = 32;
/// Default number of spheres per link, at most, if `--max-error` is given.
const MAX_SPHERES_FOR_ERROR: u32 = 10_000;
/// Default outward error, as a fraction of a shape's diagonal.
const DEFAULT_MAX_ERROR: f64 = 1e-3;

/// Reads a robot, covers its links with spheres, prints and writes.
pub fn spherize(path: &Path, options: &SphereTreeOptions) -> Result<(), Failure> {
    let most = options.spheres.unwrap_or(if options.max_error.is_some() {
        MAX_SPHERES_FOR_ERROR
    } else {
        DEFAULT_MAX_SPHERES
    });
    let error = options.max_error.unwrap_or(DEFAULT_MAX_ERROR);
    let settings = super::settings(options);
    let how = SphereOptions {
        most: most as usize,
        error,
        tree: tumble::collide::TreeSettings { error: settings.error.min(error), even: false, ..settings },
        cache: super::cache(options),
        urdf: UrdfOptions {
            packages: options.packages.iter().cloned().collect(),
            missing_meshes: options.missing_meshes,
            ..UrdfOptions::default()
        },
    };
    let planner = planner_file(path, options)?;
    if let Some((file, _)) = &planner {
        check_writable(file).map_err(Failure::input)?;
    }
    let progress = WorkProgress::new("covering", options.quiet);
    let robot = cover(path, &how, &progress);
    progress.done();
    let robot = robot?;
    if robot.links.is_empty() {
        return Err(Failure::input(format!("{}: no link has a <collision> element", path.display())));
    }
    if !options.quiet {
        robot.notes.iter().for_each(|note| println!("{note}"));
        print!("{}", table(&robot));
    }
    if let Some(output) = &options.output {
        write_file(output, robot.text.as_bytes())?;
        super::say(options, "robot", output);
    }
    if let Some((output, yaml)) = planner {
        let text = if yaml { planner_yaml(&robot) } else { planner_json(&robot) };
        write_file(&output, text.as_bytes())?;
        super::say(options, "spheres", &output);
    }
    Ok(())
}

/// Returns the file of the planner's list, and whether it is YAML. A bare format names a file
/// beside the output.
fn planner_file(path: &Path, options: &SphereTreeOptions) -> Result<Option<(PathBuf, bool)>, Failure> {
    let Some(planner) = &options.planner else { return Ok(None) };
    let (file, ending) = match planner.extension() {
        Some(ending) => (planner.clone(), ending.to_owned()),
        None => {
            let beside = options.output.as_deref().ok_or_else(|| {
                let name = path.file_stem().unwrap_or_default().to_string_lossy();
                Failure::input(format!(
                    "--planner {0} needs --output, or a file such as --planner {name}.{0}",
                    planner.display()
                ))
            })?;
            let ending = if planner.as_os_str() == "json" { "json" } else { "yml" };
            (beside.with_extension(ending), ending.into())
        }
    };
    Ok(Some((file, ending != "json")))
}

fn table(robot: &SphereRobot) -> String {
    let heads = ["link", "shapes", "spheres", "outside max mm", "outside mean mm", "covered %"];
    let worst = |link: &LinkSpheres| link.outward.iter().copied().fold(0.0, f64::max);
    let mean = |link: &LinkSpheres| link.outward.iter().sum::<f64>() / link.outward.len().max(1) as f64;
    let row = |link: &LinkSpheres| {
        let (shapes, spheres) = (link.shapes.to_string(), link.spheres.len().to_string());
        vec![
            link.name.clone(),
            shapes,
            spheres,
            format!("{:.2}", 1e3 * worst(link)),
            format!("{:.2}", 1e3 * mean(link)),
            "100.000".into(),
        ]
    };
    let rows = std::iter::once(heads.map(str::to_owned).to_vec()).chain(robot.links.iter().map(row));
    let total: usize = robot.links.iter().map(|l| l.spheres.len()).sum();
    let mut text = align_columns(rows);
    _ = writeln!(
        text,
        "{total} spheres; 100 % of the collision surface of each link is proved to lie inside the spheres of that link"
    );
    text
}

/// The format of cuRobo: `collision_spheres`, for each link a list of `center` and `radius`. Names
/// are quoted, so that none is read as a number.
fn planner_yaml(robot: &SphereRobot) -> String {
    let mut text = format!("robot: {}\ncollision_spheres:\n", Value::from(robot.name.as_str()));
    for link in &robot.links {
        _ = writeln!(text, "  {}:", Value::from(link.name.as_str()));
        for (c, radius) in &link.spheres {
            _ = writeln!(
                text,
                "    - center: [{}, {}, {}]\n      radius: {}",
                float(c.x),
                float(c.y),
                float(c.z),
                float(*radius)
            );
        }
    }
    text
}

/// Formats a number with a decimal point, so that YAML does not read it as an integer.
fn float(x: f64) -> String {
    Value::from(x).to_string()
}

/// The format of foam: for each link the errors (here how far spheres reach outside, m), and
/// `spheres` of `origin` and `radius`.
fn planner_json(robot: &SphereRobot) -> String {
    let sphere = |(c, radius): &(tumble::collide::Vec3, f64)| json!({"origin": [c.x, c.y, c.z], "radius": radius});
    let link = |link: &LinkSpheres| {
        let worst = link.outward.iter().copied().fold(0.0, f64::max);
        let best = link.outward.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = link.outward.iter().sum::<f64>() / link.outward.len().max(1) as f64;
        json!({"mean": mean, "best": best.min(worst), "worst": worst, "spheres": link.spheres.iter().map(sphere).collect::<Vec<_>>()})
    };
    let links: Map<String, Value> = robot.links.iter().map(|l| (l.name.clone(), link(l))).collect();
    format!("{:#}\n", Value::Object(links))
}
