//! Replaces a robot's collision geometry by spheres, for motion planners and for fast contact.
//!
//! Only the `<collision>` elements of the URDF's text change: each becomes one element per sphere,
//! which keeps its attributes and its children other than `<origin>` and `<geometry>`. Spheres stay
//! spheres. The other shapes of a link start with one sphere each. As long as the link may have one
//! more, the shape whose spheres reach furthest outside it gets it ([`share`]), so more spheres
//! never reach further.
//!
//! | shape | spheres |
//! |---|---|
//! | capsule | on its axis at equal distances `d`, of radius `√(R² + d²/4)`: they cover it and reach `√(R² + d²/4) − R` outside |
//! | cylinder between two spheres that contain its rounded ends | on its axis in the middle of `n` equal pieces of length `d`, of the same radius: with the ends it is a capsule, outside of which they reach as far |
//! | box, other cylinder, mesh | spheres that contain all pieces of its surface, the worst divided in two each time ([`Covering`](tumble_core::collide::Covering)); at 4, 8, 16, … spheres those of a tree are tried, and used if they reach less far |
//! | open mesh | as for the mesh with its holes closed, else for its convex hull; the given surface is covered |

use std::ops::Range;
use std::path::Path;

use roxmltree::Node;
use tumble_core::collide::{MeshError, Pose, Progress, RepairSettings, TreeCache, TreeSettings, TriMesh, Vec3};

use super::error::UrdfError;
use super::link::{Context, read_shape};
use super::options::UrdfOptions;
use super::read::{Content, read_text, text_of};
use super::share::{self, Share};
use crate::build::mesh_files::{read_file, stretched};
use crate::notes::NoteList;
use crate::parse::link::{Geometry, LinkShape};
use crate::parse::log::Log;
use crate::parse::shape::ShapeSpec;
use crate::xml::{self, Element};

/// Sides of the prism around a cylinder.
const SIDES: usize = 48;
/// Relative enlargement of written spheres, so that they still cover the shape after the rounding
/// of any reader.
const ROUNDING: f64 = 1e-9;

/// Share of a cylinder's radius by which a sphere at its end may be too small.
const ROUND: f64 = 1e-9;

/// Options of the covering by spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereOptions {
    /// Largest number of spheres of a link. A link with more collision elements is an error.
    pub most: usize,
    /// Spheres that reach at most this far outside a shape are not divided: a fraction of the
    /// shape's diagonal.
    pub error: f64,
    /// How trees are built.
    pub tree: TreeSettings,
    /// The cache of trees.
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
    /// Notes about the file and its meshes.
    pub notes: Vec<String>,
}

/// The spheres of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkSpheres {
    /// The link.
    pub name: String,
    /// Number of collision elements that it had.
    pub shapes: usize,
    /// Center in the link's frame and radius, meters.
    pub spheres: Vec<(Vec3, f64)>,
    /// Upper bound of the distance by which each reaches outside its shape, meters.
    pub outward: Vec<f64>,
}

/// A collision element: its pose, its shape, and the surface to cover in its own frame. Spheres and
/// capsules have formulas.
struct Part<'a, 'd> {
    node: Node<'a, 'd>,
    shape: LinkShape,
    surface: Surface,
}

pub(super) enum Surface {
    Sphere(f64),
    /// Radius, and length of the straight part.
    Capsule(f64, f64),
    /// Radius and length of a cylinder whose ends, with half balls on them, are in other spheres of the link.
    Barrel(f64, f64),
    /// The surface to cover, a closed surface around at least the same solid, and how far that is
    /// outside the shape it replaces.
    Mesh {
        given: TriMesh,
        solid: TriMesh,
        slack: f64,
    },
}

/// Reads a robot and covers its links by spheres. `progress` receives the fraction of links that
/// are done.
///
/// # Errors
/// [`UrdfError`]: as [`load`](super::load), and meshes that cannot be read.
pub fn spherize(
    path: impl AsRef<Path>,
    options: &SphereOptions,
    progress: &dyn Progress,
) -> Result<SphereRobot, UrdfError> {
    let path = path.as_ref();
    let text = text_of(path)?;
    // The common reader of robots reports all problems.
    let robot = read_text(&text, path, &options.urdf, Content::Geometry)?;
    let log = Log::new(&text);
    let file = path.display().to_string();
    let wrong = |why: String| UrdfError::Body { file: path.to_path_buf(), why };
    let document = xml::parse(&log, &text, super::read::EXPECTED).ok_or_else(|| wrong("it is not XML".into()))?;
    let mut context = Context {
        folder: path.parent().unwrap_or(Path::new("")),
        file: &file,
        options: &options.urdf,
        content: Content::Geometry,
        colors: Default::default(),
        notes: NoteList::default(),
    };
    let elements: Vec<Element> = Element::new(&log, document.root_element()).children("link").collect();
    let (mut links, mut edits) = (Vec::new(), Vec::new());
    for (n, link) in elements.iter().enumerate() {
        let name = link.text("name").unwrap_or("").to_owned();
        let parts = parts(link, &mut context).map_err(|why| wrong(format!("link \"{name}\": {why}")))?;
        if !parts.is_empty() {
            let shares = share::shared(parts.iter().map(|part| &part.surface), options)
                .map_err(|why| wrong(format!("link \"{name}\": {why}")))?;
            links.push(written(name, &parts, &shares, &text, &mut edits).map_err(wrong)?);
        }
        progress.report((n + 1) as f64 / elements.len() as f64);
    }
    let notes = robot.notes.into_iter().chain(context.notes.take()).collect();
    Ok(SphereRobot { name: robot.name, text: edited(&text, edits), links, notes })
}

/// Returns the collision elements of a link with their surfaces, without those that the options
/// leave out.
fn parts<'a, 'd>(link: &Element<'a, 'd>, context: &mut Context<'_>) -> Result<Vec<Part<'a, 'd>>, String> {
    let mut parts = Vec::new();
    for element in link.children("collision") {
        let Some(shape) = read_shape(&element, true, context) else { continue };
        let surface = surface(&shape.geometry, context)?;
        parts.push(Part { node: element.node(), shape, surface });
    }
    let barrels: Vec<Option<Surface>> = parts.iter().map(|part| barrel(part, &parts)).collect();
    for (part, barrel) in parts.iter_mut().zip(barrels) {
        if let Some(surface) = barrel {
            part.surface = surface;
        }
    }
    Ok(parts)
}

/// Returns the surface of a cylinder that is a capsule together with spheres of its link at both ends.
fn barrel(part: &Part<'_, '_>, parts: &[Part<'_, '_>]) -> Option<Surface> {
    let Geometry::Shape(ShapeSpec::Cylinder { radius_m, length_m }) = part.shape.geometry else { return None };
    let in_a_sphere = |end: f64| {
        let end = (part.shape.pose * nalgebra::Point3::new(0.0, 0.0, end)).coords;
        parts.iter().any(|other| match other.surface {
            Surface::Sphere(radius) => {
                (other.shape.pose.translation.vector - end).norm() + radius_m <= radius + ROUND * radius_m
            }
            _ => false,
        })
    };
    let ends = [-0.5 * length_m, 0.5 * length_m];
    ends.into_iter().all(in_a_sphere).then_some(Surface::Barrel(radius_m, length_m))
}

fn surface(geometry: &Geometry, context: &mut Context<'_>) -> Result<Surface, String> {
    let closed = |mesh: TriMesh, slack: f64| Surface::Mesh { given: mesh.clone(), solid: mesh, slack };
    match geometry {
        Geometry::Shape(ShapeSpec::Sphere { radius_m }) => Ok(Surface::Sphere(*radius_m)),
        Geometry::Shape(ShapeSpec::Capsule { radius_m, length_m }) => Ok(Surface::Capsule(*radius_m, *length_m)),
        Geometry::Shape(ShapeSpec::Box { size_m }) => Ok(closed(TriMesh::cuboid(Vec3::from(*size_m)), 0.0)),
        Geometry::Shape(ShapeSpec::Cylinder { radius_m, length_m }) => {
            // Circumscribed about the cylinder, so a covering of the prism covers the cylinder.
            let outer = radius_m / libm::cos(std::f64::consts::PI / SIDES as f64);
            Ok(closed(TriMesh::cylinder(outer, *length_m, SIDES), outer - radius_m))
        }
        Geometry::Shape(other) => Err(format!("{other:?} is not a shape of a URDF")),
        Geometry::Solid { name, .. } => Err(format!("{name} is not a shape of a URDF")),
        Geometry::File { path, scale, hull, .. } => {
            let given = read_file(path)
                .map(|mesh| stretched(mesh, *scale))
                .map_err(|why| format!("{}: {why}", path.display()))?;
            let (solid, note) = solid_of(&given, *hull).map_err(|e| format!("{}: {e}", path.display()))?;
            note.into_iter().for_each(|note| context.notes.add(path.display().to_string(), note));
            Ok(Surface::Mesh { given, solid, slack: 0.0 })
        }
    }
}

/// Returns a closed surface around the solid of a mesh, and a note about how it was closed.
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
        Err(_) => Ok((
            given.convex_hull()?,
            Some("its surface is not closed, so spheres are fitted to its convex hull".into()),
        )),
    }
}

/// Returns the spheres in the link's frame and the edits of the text.
fn written(
    name: String,
    parts: &[Part<'_, '_>],
    shares: &[Share<'_>],
    text: &str,
    edits: &mut Vec<(Range<usize>, String)>,
) -> Result<LinkSpheres, String> {
    let mut link = LinkSpheres { name, shapes: parts.len(), spheres: Vec::new(), outward: Vec::new() };
    for (part, share) in parts.iter().zip(shares) {
        let exact = matches!(part.surface, Surface::Sphere(_));
        let spheres = share.spheres();
        let placed: Vec<(Vec3, f64)> =
            spheres.iter().map(|(center, radius, _)| placed(&part.shape.pose, center, *radius, exact)).collect();
        if !exact {
            let range = part.node.range();
            if text.get(range.clone()).is_none_or(|own| !own.starts_with("<collision")) {
                return Err(format!(
                    "link \"{}\": a <collision> comes from an entity and cannot be replaced; write it out",
                    link.name
                ));
            }
            edits.push((range, elements(&part.node, &placed, text)));
        }
        link.spheres.extend(placed);
        link.outward.extend(spheres.iter().map(|sphere| sphere.2));
    }
    Ok(link)
}

fn placed(pose: &Pose, center: &Vec3, radius: f64, exact: bool) -> (Vec3, f64) {
    let center = (pose * nalgebra::Point3::from(*center)).coords;
    (center, if exact { radius } else { radius + ROUNDING * (radius + center.norm()) })
}

/// Returns one element per sphere, formatted like the original.
fn elements(node: &Node<'_, '_>, spheres: &[(Vec3, f64)], text: &str) -> String {
    let start = node.range().start;
    let indent = text[..start].rsplit('\n').next().unwrap_or("");
    let indent =
        if indent.trim().is_empty() && text[..start].contains('\n') { format!("\n{indent}") } else { String::new() };
    let of = |range: Range<usize>| text.get(range).unwrap_or("");
    let attributes: String =
        node.attributes().filter(|a| a.name() != "name").map(|a| format!(" {}", of(a.range()))).collect();
    let is_kept =
        |child: &Node<'_, '_>| child.is_element() && !child.has_tag_name("origin") && !child.has_tag_name("geometry");
    let kept: String = node.children().filter(is_kept).map(|child| of(child.range())).collect();
    // Comments are kept once, before the spheres.
    let comments: String =
        node.descendants().filter(Node::is_comment).map(|c| format!("{}{indent}", of(c.range()))).collect();
    let name = node.attribute_node("name").map(|a| of(a.range_value()));
    let element = |(n, (c, r)): (usize, &(Vec3, f64))| {
        let name = name.map_or(String::new(), |name| format!(" name=\"{}_{n}\"", name.replace('"', "&quot;")));
        let place = format!("<origin xyz=\"{} {} {}\" rpy=\"0 0 0\"/>", c.x, c.y, c.z);
        format!("<collision{name}{attributes}>{place}<geometry><sphere radius=\"{r}\"/></geometry>{kept}</collision>")
    };
    comments + &spheres.iter().enumerate().map(element).collect::<Vec<_>>().join(&indent)
}

/// Returns the text with the ranges, which are disjoint and in order, replaced.
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
