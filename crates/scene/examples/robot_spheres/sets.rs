//! Sets of spheres to compare with.

use std::error::Error;
use std::path::Path;
use tumble_core::collide::{Pose, Vec3};
use urdf_rs::{Collision, Geometry, Link};

/// Center in the frame of the link, and radius, meters.
pub type Set = Vec<(Vec3, f64)>;

/// Reads the spheres of each link from a URDF, or from a YAML with `center` and `radius`.
pub fn read_spheres(path: &Path) -> Result<Vec<(String, Set)>, Box<dyn Error>> {
    if path.extension().is_some_and(|ending| ending == "urdf") {
        let robot = urdf_rs::read_file(path)?;
        let sphere = |collision: &Collision| match collision.geometry {
            Geometry::Sphere { radius } => Some((Vec3::from(collision.origin.xyz.0), radius)),
            _ => None,
        };
        return Ok(robot
            .links
            .iter()
            .map(|link| (link.name.clone(), link.collision.iter().filter_map(sphere).collect()))
            .collect());
    }
    let mut links: Vec<(String, Set)> = Vec::new();
    let mut name = String::new();
    let mut center = Vec3::zeros();
    for line in std::fs::read_to_string(path)?.lines() {
        let line = line.split('#').next().unwrap_or("").replace(['"', '\''], "");
        let Some((key, value)) = line.trim().trim_start_matches("- ").split_once(':') else { continue };
        match key.trim() {
            "center" => {
                let numbers = value.trim().trim_matches(['[', ']']).split(',').map(|x| x.trim().parse());
                center = Vec3::from_iterator(numbers.collect::<Result<Vec<f64>, _>>()?);
            }
            "radius" => {
                if links.last().is_none_or(|last| last.0 != name) {
                    links.push((name.clone(), Set::new()));
                }
                let radius = value.trim().parse()?;
                links.last_mut().ok_or("a radius without a link")?.1.push((center, radius));
            }
            other => name = other.into(),
        }
    }
    Ok(links)
}

/// Returns plain chains: for each cylinder of a link, spheres at equal distances from end to end of
/// its axis that contain its side. The chain that extends furthest outside gets the next sphere.
pub fn capsule_chains(links: &[Link], count: usize) -> Vec<(String, Set)> {
    links
        .iter()
        .filter(|link| !link.collision.is_empty())
        .map(|link| (link.name.clone(), chains(link, count)))
        .collect()
}

fn chains(link: &Link, count: usize) -> Set {
    let mut axes: Vec<(Pose, f64, f64, usize)> = link
        .collision
        .iter()
        .filter_map(|collision| match collision.geometry {
            Geometry::Cylinder { radius, length } => {
                let ([x, y, z], [roll, pitch, yaw]) = (collision.origin.xyz.0, collision.origin.rpy.0);
                let turn = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
                Some((Pose::from_parts(Vec3::new(x, y, z).into(), turn), radius, length, 2))
            }
            _ => None,
        })
        .collect();
    let excess =
        |(_, radius, length, n): &(Pose, f64, f64, usize)| radius.hypot(0.5 * length / (n - 1) as f64) - radius;
    while !axes.is_empty() && axes.iter().map(|axis| axis.3).sum::<usize>() < count {
        let worst = (0..axes.len()).max_by(|a, b| excess(&axes[*a]).total_cmp(&excess(&axes[*b]))).unwrap_or(0);
        axes[worst].3 += 1;
    }
    let spheres = |axis: &(Pose, f64, f64, usize)| {
        let (pose, radius, length, n) = *axis;
        let reach = radius + excess(axis);
        let at = move |k: usize| pose * nalgebra::Point3::new(0.0, 0.0, length * (k as f64 / (n - 1) as f64 - 0.5));
        (0..n).map(|k| (at(k).coords, reach)).collect::<Set>()
    };
    axes.iter().flat_map(spheres).collect()
}
