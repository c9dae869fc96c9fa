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
use tumble::scene::urdf::{
    JointPositions, LinkSpheres, Overlap, PerLink, SphereOptions, SphereRobot, UrdfOptions, spherize as cover,
};

/// Default number of spheres per link, at most.
const DEFAULT_MAX_SPHERES: usize = 32;
/// Default number of spheres per link, at most, if `--max-error` is given.
const MAX_SPHERES_FOR_ERROR: usize = 10_000;
/// Default outward error, as a fraction of a shape's diagonal.
const DEFAULT_MAX_ERROR: f64 = 1e-3;

/// Reads a robot, covers its links with spheres, prints and writes.
pub fn spherize(path: &Path, options: &SphereTreeOptions) -> Result<(), Failure> {
    let common = if options.max_error.is_some() { MAX_SPHERES_FOR_ERROR } else { DEFAULT_MAX_SPHERES };
    let most = per_link(&options.spheres, common);
    let [coverage, weight] = [&options.coverage, &options.weight].map(|given| {
        per_link(&given.iter().map(|(link, value)| (link.clone(), Some(*value))).collect::<Vec<_>>(), None)
    });
    let error = options.max_error.unwrap_or(DEFAULT_MAX_ERROR);
    let settings = super::settings(options);
    let how = SphereOptions {
        most,
        coverage,
        weight,
        error,
        tree: tumble::collide::TreeSettings { error: settings.error.min(error), even: false, ..settings },
        cache: super::cache(options),
        urdf: UrdfOptions {
            packages: options.packages.iter().cloned().collect(),
            missing_meshes: options.missing_meshes,
            ..UrdfOptions::default()
        },
    };
    if let Some(output) = &options.output {
        check_urdf(output)?;
    }
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
    let ignored = Ignored::of(&robot, options).map_err(Failure::input)?;
    if !options.quiet {
        robot.notes.iter().for_each(|note| println!("{note}"));
        print!("{}", table(&robot));
        print!("{}", ignored.table);
    }
    if let Some(output) = &options.output {
        write_file(output, robot.text.as_bytes())?;
        super::say(options, "robot", output);
    }
    if let Some((output, yaml)) = planner {
        let text = if yaml { planner_yaml(&robot, &ignored.pairs) } else { planner_json(&robot) };
        write_file(&output, text.as_bytes())?;
        super::say(options, "spheres", &output);
    }
    Ok(())
}

/// Returns the values of an option that may name links.
fn per_link<T: Copy>(given: &[(Option<String>, T)], common: T) -> PerLink<T> {
    let mut values = PerLink::all(common);
    for (link, value) in given {
        match link {
            Some(link) => _ = values.links.insert(link.clone(), *value),
            None => values.common = *value,
        }
    }
    values
}

/// Checks the name of the robot of spheres: a list for planners has another ending, so that neither replaces the other.
fn check_urdf(output: &Path) -> Result<(), Failure> {
    match output.extension() {
        Some(ending) if !["urdf", "xml"].iter().any(|known| ending.eq_ignore_ascii_case(known)) => {
            Err(Failure::input(format!(
                "--output {}: the robot of spheres is written as URDF; expected a file that ends in .urdf or .xml. A list for \
                 planners is --planner {0}",
                output.display()
            )))
        }
        _ => Ok(()),
    }
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

/// Returns how far the spheres of a link reach outside it at most, meters.
fn worst(link: &LinkSpheres) -> f64 {
    link.outward.iter().copied().fold(0.0, f64::max)
}

/// Returns the volume outside as a fraction of that of the link.
fn outside(link: &LinkSpheres) -> f64 {
    if link.volume_outside > 0.0 { link.volume_outside / link.volume } else { 0.0 }
}

/// Returns a share in percent, rounded down to three digits.
fn percent(share: f64) -> f64 {
    1e5_f64.mul_add(share, 1e-9).floor() / 1e3
}

fn table(robot: &SphereRobot) -> String {
    let heads = ["link", "shapes", "spheres", "outside max mm", "outside mean mm", "volume outside %", "covered %"];
    let row = |link: &LinkSpheres| {
        let (shapes, spheres) = (link.shapes.to_string(), link.spheres.len().to_string());
        vec![
            link.name.clone(),
            shapes,
            spheres,
            format!("{:.2}", 1e3 * worst(link)),
            format!("{:.2}", 1e3 * link.mean_outward),
            format!("{:.2}", 1e2 * outside(link)),
            format!("{:.3}", percent(link.coverage)),
        ]
    };
    let rows = std::iter::once(heads.map(str::to_owned).to_vec()).chain(robot.links.iter().map(row));
    let total: usize = robot.links.iter().map(|l| l.spheres.len()).sum();
    let mut text = align_columns(rows);
    let all = robot.links.iter().all(|link| link.coverage >= 1.0);
    let proved = if all {
        "100 % of the collision surface of each link is proved to lie inside the spheres of that link"
    } else {
        "covered: the share by area of the outer surface of each link that is proved to lie inside the spheres of that link"
    };
    _ = writeln!(text, "{total} spheres; {proved}");
    text
}

/// Pairs of links that planners need not compare.
struct Ignored {
    pairs: Vec<[usize; 2]>,
    /// The overlaps at the poses of the options.
    table: String,
}

impl Ignored {
    fn of(robot: &SphereRobot, options: &SphereTreeOptions) -> Result<Ignored, String> {
        let samples = robot.sample_poses(options.sample_poses, 0);
        let pairs = robot.ignored_pairs(&options.poses, &samples)?;
        let mut text = String::new();
        for (n, pose) in options.poses.iter().enumerate() {
            let overlaps = robot.overlaps(pose)?;
            _ = writeln!(text, "pose {}: {} of links overlap", n + 1, pairs_of(overlaps.len()));
            text += &overlap_table(robot, &overlaps);
        }
        if !samples.is_empty() {
            text += &sample_table(robot, &samples, &pairs)?;
        }
        Ok(Ignored { pairs, table: text })
    }
}

fn pairs_of(count: usize) -> String {
    format!("{count} pair{}", if count == 1 { "" } else { "s" })
}

fn overlap_table(robot: &SphereRobot, overlaps: &[Overlap]) -> String {
    if overlaps.is_empty() {
        return String::new();
    }
    let row = |overlap: &Overlap| {
        let [a, b] = overlap.links.map(|link| robot.links[link].name.clone());
        vec![a, b, format!("{:.2}", 1e3 * overlap.depth), if overlap.adjacent { "yes" } else { "no" }.into()]
    };
    let head = ["link", "link", "overlap mm", "adjacent"].map(str::to_owned).to_vec();
    align_columns(std::iter::once(head).chain(overlaps.iter().map(row)))
}

/// Returns how many of the sampled poses are free of overlaps other than of ignored pairs.
fn sample_table(robot: &SphereRobot, samples: &[JointPositions], ignored: &[[usize; 2]]) -> Result<String, String> {
    let mut colliding = 0;
    for pose in samples {
        colliding += usize::from(robot.overlaps(pose)?.iter().any(|overlap| !ignored.contains(&overlap.links)));
    }
    let ignored = pairs_of(ignored.len());
    Ok(format!("{colliding} of {} sampled poses collide, {ignored} of links ignored\n", samples.len()))
}

/// The format of cuRobo: `collision_spheres`, for each link a list of `center` and `radius`;
/// `self_collision_ignore`, for a link the later links that are not compared with it;
/// `self_collision_buffer`, a distance for each link, here 0. Names are quoted, so that none is read
/// as a number.
fn planner_yaml(robot: &SphereRobot, ignored: &[[usize; 2]]) -> String {
    let mut text = format!("robot: {}\ncollision_spheres:\n", Value::from(robot.name.as_str()));
    for link in &robot.links {
        _ = writeln!(
            text,
            "  # covered {:.3} %; outside at most {:.2} mm, mean {:.2} mm, volume {:.2} %\n  {}:",
            percent(link.coverage),
            1e3 * worst(link),
            1e3 * link.mean_outward,
            1e2 * outside(link),
            Value::from(link.name.as_str())
        );
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
    let name = |link: usize| Value::from(robot.links[link].name.as_str());
    let later = |link: usize| {
        let names: Vec<String> =
            ignored.iter().filter(|pair| pair[0] == link).map(|pair| name(pair[1]).to_string()).collect();
        (!names.is_empty()).then(|| format!("  {}: [{}]\n", name(link), names.join(", ")))
    };
    let pairs: String = (0..robot.links.len()).filter_map(later).collect();
    let buffers: String = (0..robot.links.len()).map(|link| format!("  {}: 0.0\n", name(link))).collect();
    text += &if pairs.is_empty() {
        "self_collision_ignore: {}\n".into()
    } else {
        format!("self_collision_ignore:\n{pairs}")
    };
    text + "self_collision_buffer:\n" + &buffers
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
        let worst = worst(link);
        let best = link.outward.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = link.outward.iter().sum::<f64>() / link.outward.len().max(1) as f64;
        json!({"mean": mean, "best": best.min(worst), "worst": worst, "spheres": link.spheres.iter().map(sphere).collect::<Vec<_>>()})
    };
    let links: Map<String, Value> = robot.links.iter().map(|l| (l.name.clone(), link(l))).collect();
    format!("{:#}\n", Value::Object(links))
}
