//! A robot whose collision geometry is spheres, for motion planners and for fast contact.
//!
//! The text of the URDF stays as it is but for the `<collision>` elements: each becomes one element per sphere, which keeps its attributes and its
//! children other than `<origin>` and `<geometry>`. Spheres stay spheres. The other shapes of a link share the spheres that it may have by their surface:
//!
//! | shape | spheres |
//! |---|---|
//! | capsule | on its axis at equal distances `d`, of radius `√(R² + d²/4)`: they cover it and reach `√(R² + d²/4) − R` outside |
//! | box, cylinder, mesh | up to 64: a tree of one level with that many branches; more, or an octree: the best of the cuts ([`SphereTree::cut`]) of deeper trees |
//! | open mesh | those of the mesh with its holes closed, else of its convex hull |
//!
//! Whatever made them, the spheres are then grown until they cover the surface as it was given, which is found by splitting its triangles until each piece
//! lies in one sphere ([`grow_to_cover`]); mostly nothing grows. So all of the surface is inside, not all samples of it.

use std::ops::Range;
use std::path::Path;

use roxmltree::Node;
use tumble_core::collide::{
    Builder, MeshDistance, MeshError, Pose, Progress, RepairSettings, SphereTree, TreeCache, TreeSettings, TriMesh, Vec3, grow_to_cover,
};

use super::link::{Context, read_shape};
use super::xml::{self, Element};
use super::{UrdfError, UrdfOptions, read_text, text_of};
use crate::link::{Geometry, LinkShape};
use crate::link_shapes::{read_file, stretched};
use crate::log::Log;
use crate::notes::NoteList;
use crate::shape::ShapeSpec;

/// Sides of the prism around a cylinder.
const SIDES: usize = 48;
/// Spheres are written larger by this share, so that they hold what they should after any reader's rounding.
const ROUNDING: f64 = 1e-9;
/// Most branches of a tree.
const MOST_BRANCHES: usize = 64;

/// How a robot is covered by spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereOptions {
    /// Most spheres of a link; a link with more collision elements than this has one for each.
    pub most: usize,
    /// Spheres that reach at most this far outside a shape are not divided: a share of the shape's diagonal.
    pub error: f64,
    /// How trees are built.
    pub tree: TreeSettings,
    /// Where they are kept.
    pub cache: TreeCache,
    /// How the URDF is read.
    pub urdf: UrdfOptions,
}

/// A robot of spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereRobot {
    /// Its name.
    pub name: String,
    /// The URDF.
    pub text: String,
    /// Its links with collision geometry, in the order of the file.
    pub links: Vec<LinkSpheres>,
    /// What is to be said of the file and its meshes.
    pub notes: Vec<String>,
}

/// The spheres of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkSpheres {
    /// The link.
    pub name: String,
    /// How many collision elements it had.
    pub shapes: usize,
    /// Centre in the link's frame and radius, metres.
    pub spheres: Vec<(Vec3, f64)>,
    /// How far each reaches outside the shape it stands for, at most, metres.
    pub outward: Vec<f64>,
    /// Most that a sphere was grown to cover the surface, metres.
    pub grown: f64,
}

/// Spheres in a shape's own frame, and how far each reaches outside it at most.
struct Covered {
    spheres: Vec<(Vec3, f64)>,
    outward: Vec<f64>,
    grown: f64,
}

/// A collision element: where it stands, what it is, and the surface to cover, in its own frame. Spheres and capsules are known by formula.
struct Part<'a, 'd> {
    node: Node<'a, 'd>,
    shape: LinkShape,
    surface: Surface,
}

enum Surface {
    Sphere(f64),
    /// Radius, and length of the straight part.
    Capsule(f64, f64),
    /// The surface that is to be covered, a closed one around the same solid or more, and how far that is outside the shape that it stands for.
    Mesh { given: TriMesh, solid: TriMesh, slack: f64 },
}

/// Reads a robot and covers its links by spheres; `progress` is told the share of links that are done.
///
/// # Errors
/// [`UrdfError`]: those of [`load`](super::load), and meshes that cannot be read.
pub fn spherize(path: impl AsRef<Path>, options: &SphereOptions, progress: &dyn Progress) -> Result<SphereRobot, UrdfError> {
    let path = path.as_ref();
    let text = text_of(path)?;
    // all that is wrong with it is found by the one reader of robots
    let robot = read_text(&text, path, &options.urdf, true)?;
    let log = Log::new(&text);
    let file = path.display().to_string();
    let wrong = |why: String| UrdfError::Body { file: path.to_path_buf(), why };
    let document = xml::parse(&log, &text).ok_or_else(|| wrong("it is no XML".into()))?;
    let mut context = Context {
        folder: path.parent().unwrap_or(Path::new("")),
        file: &file,
        options: &options.urdf,
        shapes: true,
        colors: Default::default(),
        notes: NoteList::default(),
    };
    let elements: Vec<Element> = Element::new(&log, document.root_element()).children("link").collect();
    let (mut links, mut edits) = (Vec::new(), Vec::new());
    for (n, link) in elements.iter().enumerate() {
        let name = link.text("name").unwrap_or("").to_owned();
        let parts = parts(link, &mut context).map_err(|why| wrong(format!("link \"{name}\": {why}")))?;
        if !parts.is_empty() {
            let covered = cover_parts(&parts, options).map_err(|why| wrong(format!("link \"{name}\": {why}")))?;
            links.push(written(name, &parts, covered, &text, &mut edits).map_err(wrong)?);
        }
        progress.at((n + 1) as f64 / elements.len() as f64);
    }
    let notes = robot.notes.into_iter().chain(context.notes.take()).collect();
    Ok(SphereRobot { name: robot.name, text: edited(&text, edits), links, notes })
}

/// The collision elements of a link with their surfaces; those that the options leave out are left out.
fn parts<'a, 'd>(link: &Element<'a, 'd>, context: &mut Context<'_>) -> Result<Vec<Part<'a, 'd>>, String> {
    let mut parts = Vec::new();
    for element in link.children("collision") {
        let Some(shape) = read_shape(&element, true, context) else { continue };
        let surface = surface(&shape.geometry, context)?;
        parts.push(Part { node: element.node(), shape, surface });
    }
    Ok(parts)
}

fn surface(geometry: &Geometry, context: &mut Context<'_>) -> Result<Surface, String> {
    let closed = |mesh: TriMesh, slack: f64| Surface::Mesh { given: mesh.clone(), solid: mesh, slack };
    match geometry {
        Geometry::Shape(ShapeSpec::Sphere { radius_m }) => Ok(Surface::Sphere(*radius_m)),
        Geometry::Shape(ShapeSpec::Capsule { radius_m, length_m }) => Ok(Surface::Capsule(*radius_m, *length_m)),
        Geometry::Shape(ShapeSpec::Box { size_m }) => Ok(closed(TriMesh::box_(0.5 * Vec3::from(*size_m)), 0.0)),
        Geometry::Shape(ShapeSpec::Cylinder { radius_m, height_m }) => {
            // around the cylinder, so that what covers the prism covers it
            let outer = radius_m / libm::cos(std::f64::consts::PI / SIDES as f64);
            Ok(closed(TriMesh::cylinder(outer, 0.5 * height_m, SIDES), outer - radius_m))
        }
        Geometry::Shape(other) => Err(format!("{other:?} is no shape of a URDF")),
        Geometry::File { path, scale, hull, .. } => {
            let given = read_file(path).map(|mesh| stretched(mesh, *scale)).map_err(|why| format!("{}: {why}", path.display()))?;
            let (solid, note) = solid_of(&given, *hull).map_err(|e| format!("{}: {e}", path.display()))?;
            note.into_iter().for_each(|note| context.notes.add(path.display().to_string(), note));
            Ok(Surface::Mesh { given, solid, slack: 0.0 })
        }
    }
}

/// A closed surface around what a mesh encloses, and what was done for that.
fn solid_of(given: &TriMesh, hull: bool) -> Result<(TriMesh, Option<String>), MeshError> {
    let mut solid = given.clone();
    if hull {
        return Ok((given.convex_hull()?, None));
    }
    if solid.check_closed().is_ok() {
        return Ok((solid, None));
    }
    match solid.repair(&RepairSettings::default()) {
        Ok(report) => Ok((solid, Some(format!("its surface is not closed; {}", report.notes().join("; "))))),
        Err(_) => Ok((given.convex_hull()?, Some("its surface is not closed, so spheres are fitted to its convex hull".into()))),
    }
}

/// The spheres of all parts of a link, which share what it may have by their surfaces.
fn cover_parts(parts: &[Part<'_, '_>], options: &SphereOptions) -> Result<Vec<Covered>, String> {
    let area = |part: &Part<'_, '_>| match &part.surface {
        Surface::Sphere(_) => 0.0,
        Surface::Capsule(radius, length) => 2.0 * std::f64::consts::PI * radius * (length + 2.0 * radius),
        Surface::Mesh { solid, .. } => solid.area(),
    };
    let whole: f64 = parts.iter().map(area).sum();
    // one for each, the rest by surface
    let spare = options.most.saturating_sub(parts.len()) as f64;
    let most = |part: &Part<'_, '_>| 1 + (spare * area(part) / whole.max(f64::MIN_POSITIVE)) as usize;
    parts.iter().map(|part| part.surface.cover(most(part), options)).collect()
}

impl Surface {
    fn cover(&self, most: usize, options: &SphereOptions) -> Result<Covered, String> {
        match self {
            Surface::Sphere(radius) => Ok(Covered { spheres: vec![(Vec3::zeros(), *radius)], outward: vec![0.0], grown: 0.0 }),
            Surface::Capsule(radius, length) => Ok(cover_capsule(*radius, *length, most, options.error)),
            Surface::Mesh { given, solid, slack } => {
                let covered = cover_mesh(given, solid, most, options)?;
                Ok(Covered { outward: covered.outward.iter().map(|o| o + slack).collect(), ..covered })
            }
        }
    }
}

fn cover_capsule(radius: f64, length: f64, most: usize, error: f64) -> Covered {
    let reach = |count: usize| {
        // one alone holds the ends
        if count == 1 { radius + 0.5 * length } else { (radius * radius + 0.25 * (length / (count - 1) as f64).powi(2)).sqrt() }
    };
    let wanted = radius + error * (length + 2.0 * radius);
    let count = (1..=most.max(1)).find(|n| reach(*n) <= wanted).unwrap_or(most.max(1));
    let at = |n: usize| if count == 1 { 0.0 } else { length * (n as f64 / (count - 1) as f64 - 0.5) };
    let spheres: Vec<(Vec3, f64)> = (0..count).map(|n| (Vec3::z() * at(n), reach(count))).collect();
    Covered { outward: vec![reach(count) - radius; count], spheres, grown: 0.0 }
}

fn cover_mesh(given: &TriMesh, solid: &TriMesh, most: usize, options: &SphereOptions) -> Result<Covered, String> {
    let distance = MeshDistance::new(solid);
    let diagonal = solid.diagonal();
    let mut best: Option<Covered> = None;
    let mut take = |mut spheres: Vec<(Vec3, f64)>| {
        let grown = grow_to_cover(&mut spheres, given);
        let outward: Vec<f64> = spheres.iter().map(|(c, r)| (r + distance.closest(c).signed_distance).max(0.0)).collect();
        let covered = Covered { spheres, outward, grown };
        if best.as_ref().is_none_or(|best| covered.worst() < best.worst()) {
            best = Some(covered);
        }
    };
    let bounds = solid.aabb();
    let middle = 0.5 * (bounds.min + bounds.max);
    take(vec![(middle, solid.vertices.iter().map(|v| (v - middle).norm()).fold(0.0, f64::max))]);
    for settings in trees(most, &options.tree) {
        let tree = SphereTree::build_cached(solid, &settings, &options.cache).map_err(|e| e.to_string())?.tree;
        take(tree.cut(most, options.error * diagonal).iter().map(|&n| (tree.nodes()[n].center, tree.nodes()[n].radius)).collect());
        if tree.leaves().count() > most {
            break;
        }
    }
    best.ok_or_else(|| "no tree was built".into())
}

/// The trees worth trying for at most so many balls, coarse ones first. Leaves are tighter than the balls around them, so a tree with few more leaves
/// than are wanted gives the best cut.
fn trees(most: usize, usual: &TreeSettings) -> Vec<TreeSettings> {
    if usual.builder != Builder::Octree && most <= MOST_BRANCHES {
        return vec![TreeSettings { branch: most.max(2) as u32, depth: 1, ..*usual }];
    }
    let enough = (1..usual.depth).find(|d| (usual.branch as usize).saturating_pow(*d) >= most).unwrap_or(usual.depth);
    let first = if usual.builder == Builder::Octree { 1 } else { enough };
    let last = if usual.builder == Builder::Octree { usual.depth } else { enough };
    (first..=last).map(|depth| TreeSettings { depth, ..*usual }).collect()
}

impl Covered {
    fn worst(&self) -> f64 {
        self.outward.iter().copied().fold(0.0, f64::max)
    }
}

/// The spheres in the link's frame, and the edits that write them.
fn written(name: String, parts: &[Part<'_, '_>], covered: Vec<Covered>, text: &str, edits: &mut Vec<(Range<usize>, String)>) -> Result<LinkSpheres, String> {
    let mut link = LinkSpheres { name, shapes: parts.len(), spheres: Vec::new(), outward: Vec::new(), grown: 0.0 };
    for (part, covered) in parts.iter().zip(covered) {
        link.grown = link.grown.max(covered.grown);
        let exact = matches!(part.surface, Surface::Sphere(_));
        let placed = covered.spheres.iter().map(|(center, radius)| placed(&part.shape.pose, center, *radius, exact));
        let placed: Vec<(Vec3, f64)> = placed.collect();
        if !exact {
            let range = part.node.range();
            if text.get(range.clone()).is_none_or(|own| !own.starts_with("<collision")) {
                return Err(format!("link \"{}\": a <collision> comes from an entity and cannot be replaced; write it out", link.name));
            }
            edits.push((range, elements(&part.node, &placed, text)));
        }
        link.spheres.extend(placed);
        link.outward.extend(covered.outward);
    }
    Ok(link)
}

fn placed(pose: &Pose, center: &Vec3, radius: f64, exact: bool) -> (Vec3, f64) {
    let center = (pose * nalgebra::Point3::from(*center)).coords;
    (center, if exact { radius } else { radius + ROUNDING * (radius + center.norm()) })
}

/// One element per sphere, set as the original was.
fn elements(node: &Node<'_, '_>, spheres: &[(Vec3, f64)], text: &str) -> String {
    let start = node.range().start;
    let indent = text[..start].rsplit('\n').next().unwrap_or("");
    let indent = if indent.trim().is_empty() && text[..start].contains('\n') { format!("\n{indent}") } else { String::new() };
    let of = |range: Range<usize>| text.get(range).unwrap_or("");
    let attributes: String = node.attributes().filter(|a| a.name() != "name").map(|a| format!(" {}", of(a.range()))).collect();
    let is_kept = |child: &Node<'_, '_>| child.is_element() && !child.has_tag_name("origin") && !child.has_tag_name("geometry");
    let kept: String = node.children().filter(is_kept).map(|child| of(child.range())).collect();
    // comments stand once, before the spheres
    let comments: String = node.descendants().filter(Node::is_comment).map(|c| format!("{}{indent}", of(c.range()))).collect();
    let name = node.attribute_node("name").map(|a| of(a.range_value()));
    let element = |(n, (c, r)): (usize, &(Vec3, f64))| {
        let name = name.map_or(String::new(), |name| format!(" name=\"{}_{n}\"", name.replace('"', "&quot;")));
        let place = format!("<origin xyz=\"{} {} {}\" rpy=\"0 0 0\"/>", c.x, c.y, c.z);
        format!("<collision{name}{attributes}>{place}<geometry><sphere radius=\"{r}\"/></geometry>{kept}</collision>")
    };
    comments + &spheres.iter().enumerate().map(element).collect::<Vec<_>>().join(&indent)
}

/// The text with the ranges, which are in order and apart, replaced.
fn edited(text: &str, edits: Vec<(Range<usize>, String)>) -> String {
    let mut out = String::with_capacity(text.len());
    let mut last = 0;
    for (range, new) in edits {
        out.push_str(&text[last..range.start]);
        out.push_str(&new);
        last = range.end;
    }
    out.push_str(&text[last..]);
    out
}
