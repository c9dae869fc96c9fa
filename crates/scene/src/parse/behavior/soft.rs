//! `[[cloth]]` and `[[jelly]]`: meshes of springs.

use tumble_behaviors::{Cloth, Jelly};
use tumble_core::Material;

use crate::parse::appearance::AppearanceSpec;
use crate::parse::body::{Library, read_material, read_name};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Value};
use crate::parse::material::read_contact;
use crate::parse::rotation;
use toml::de::DeValue;
use tumble_core::collide::Pose;

/// Largest number of nodes along an axis, and of all nodes of a mesh: what NetSync sends of one object.
const MOST_ALONG: u32 = 1_000;
const MOST_NODES: usize = 65_535;
/// Largest number of entries of `pins`.
const MOST_PINS: usize = MOST_NODES;

/// A cloth or a jelly at time 0.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftSpec {
    /// Unique in the scene.
    pub name: String,
    /// The grid of nodes and springs.
    pub grid: Grid,
    /// Pose of the middle of the grid.
    pub pose: Pose,
    /// Velocity of all nodes, world axes, m/s. Default 0.
    pub velocity_m_per_s: [f64; 3],
    /// Radius with which the nodes collide, m. Default: they do not.
    pub node_radius_m: Option<f64>,
    /// Numbers of the nodes that never move. Default none.
    pub pins: Vec<usize>,
    /// Time in a step at which the springs act, ½ to 1. Default 1.
    pub implicitness: f64,
    /// Index of its material, if it names one.
    pub material: Option<usize>,
    /// Contact constants: its own, else its material's, else the default ones.
    pub contact: Material,
    /// Appearance of its surface.
    pub appearance: AppearanceSpec,
    /// Whether its nodes collide, if they have a radius. Default true.
    pub collidable: bool,
    /// Whether it takes part in the simulation. Default true.
    pub enabled: bool,
}

/// The grid of a [`SoftSpec`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grid {
    /// `[[cloth]]`.
    Cloth(Cloth),
    /// `[[jelly]]`.
    Jelly(Jelly),
}

impl Grid {
    fn nodes(&self) -> usize {
        match self {
            Grid::Cloth(cloth) => cloth.nodes.iter().product(),
            Grid::Jelly(jelly) => jelly.nodes.iter().product(),
        }
    }

    fn side(&self, name: &str) -> Option<Vec<usize>> {
        match self {
            Grid::Cloth(cloth) => cloth.side(name),
            Grid::Jelly(jelly) => jelly.side(name),
        }
    }
}

impl SoftSpec {
    /// Reads a table; a cloth has two dimensions and a jelly three.
    pub(crate) fn read(f: &mut Fields<'_>, library: &Library<'_>, dimensions: usize) -> SoftSpec {
        let name = read_name(f).unwrap_or_default();
        let grid = read_grid(f, dimensions);
        let material = read_material(f, library);
        let base = material.map(|index| &library.materials[index]);
        let of_material = base.map_or_else(Material::default, |material| material.contact);
        let appearance = base.map_or_else(AppearanceSpec::default, |material| material.appearance.clone());
        SoftSpec {
            name,
            grid,
            pose: rotation::read_pose(f),
            velocity_m_per_s: f.vector_or("velocity_m_per_s", Bound::ANY, [0.0; 3]),
            node_radius_m: f.optional_number("node_radius_m", Bound::POSITIVE),
            pins: read_pins(f, &grid),
            implicitness: f.number_or("implicitness", Bound::new(0.5, 1.0, "a number from 0.5 to 1"), 1.0),
            material,
            contact: read_contact(f, &of_material),
            appearance: AppearanceSpec::read(f, &appearance),
            collidable: f.flag_or("collidable", true),
            enabled: f.flag_or("enabled", true),
        }
    }
}

fn read_grid(f: &mut Fields<'_>, dimensions: usize) -> Grid {
    let (cloth, jelly) = (Cloth::default(), Jelly::default());
    let flat = dimensions == 2;
    let mass = f.number_or("mass_kg", Bound::POSITIVE, if flat { cloth.mass } else { jelly.mass });
    let usual = if flat { cloth.stiffness } else { jelly.stiffness };
    let stiffness = f.vector_or("stiffness_n_per_m", Bound::NOT_NEGATIVE, usual);
    let damping = f.number_or("damping_s", Bound::NOT_NEGATIVE, cloth.damping);
    if flat {
        let (nodes, size) = (read_nodes(f, cloth.nodes), f.vector_or("size_m", Bound::POSITIVE, cloth.size));
        Grid::Cloth(Cloth { nodes, size, mass, stiffness, damping })
    } else {
        let (nodes, size) = (read_nodes(f, jelly.nodes), f.vector_or("size_m", Bound::POSITIVE, jelly.size));
        Grid::Jelly(Jelly { nodes, size, mass, stiffness, damping })
    }
}

/// Reads the numbers of nodes along the axes.
fn read_nodes<const N: usize>(f: &mut Fields<'_>, usual: [usize; N]) -> [usize; N] {
    let Some(value) = f.value("nodes") else { return usual };
    let expected = format!("a list of {N} whole numbers from 2 to {MOST_ALONG}, at most {MOST_NODES} nodes together");
    match value.get_ref().as_array() {
        Some(items) if items.len() == N => {
            let problems = f.log.count();
            let nodes: Vec<usize> =
                items.iter().map(|item| f.as_integer("nodes", item, 2..=MOST_ALONG) as usize).collect();
            let nodes = nodes.try_into().unwrap_or(usual);
            if f.log.count() == problems && nodes.iter().product::<usize>() > MOST_NODES {
                f.wrong("nodes", value, expected);
                return usual;
            }
            nodes
        }
        _ => {
            f.wrong("nodes", value, expected);
            usual
        }
    }
}

/// Reads the pinned nodes: names of sides, `corners`, and numbers.
fn read_pins(f: &mut Fields<'_>, grid: &Grid) -> Vec<usize> {
    let side = match grid {
        Grid::Cloth(_) => "\"x_min\", \"x_max\", \"y_min\", \"y_max\" or \"corners\"",
        Grid::Jelly(_) => "\"x_min\" to \"z_max\" or \"corners\"",
    };
    let expected = format!("a list of sides ({side}) and of numbers of nodes from 0 to {}", grid.nodes() - 1);
    let one = |item: &Value<'_>| match item.get_ref() {
        DeValue::String(name) => grid.side(name),
        DeValue::Integer(digits) => {
            let number = usize::from_str_radix(digits.as_str(), digits.radix()).ok();
            number.filter(|number| *number < grid.nodes()).map(|number| vec![number])
        }
        _ => None,
    };
    let mut pins = Vec::new();
    for item in f.list("pins", MOST_PINS, &expected) {
        match one(item) {
            Some(nodes) => pins.extend(nodes),
            None => f.wrong("pins", item, &expected),
        }
    }
    pins.sort_unstable();
    pins.dedup();
    pins
}
