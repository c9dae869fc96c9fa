//! Replaces a robot's collision geometry by spheres, for motion planners and for fast contact.
//!
//! Only the `<collision>` elements of the URDF's text change: each becomes one element per sphere,
//! which keeps its attributes and its children other than `<origin>` and `<geometry>`. A sphere that
//! covers pieces of several elements is written instead of the one with the most pieces, and an
//! element whose surface other spheres cover disappears. [`fit`](super::fit) chooses the spheres.
//!
//! | shape | surface that is covered |
//! |---|---|
//! | sphere, capsule, cylinder with a sphere about each end | by formula ([`chain`](super::chain)), or that of a prism with the height of the arcs above it |
//! | box, other cylinder, closed mesh | the part outside the other shapes of the link |
//! | open mesh | all of it; it is measured against the mesh with its holes closed, else against its convex hull |

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use roxmltree::Node;
use tumble_core::collide::{MeshError, Progress, RepairSettings, TreeCache, TreeSettings, TriMesh, Vec3};

use super::error::UrdfError;
use super::fit::{Aim, Fit, FittedSphere, Form, fit, placed};
use super::link::{Context, read_shape};
use super::options::UrdfOptions;
use super::read::{Content, read_text, text_of};
use super::self_collision::{self, TreeLink};
use super::solid::{Figures, Solid};
use crate::build::mesh_files::{read_file, stretched};
use crate::notes::NoteList;
use crate::parse::link::{Geometry, LinkShape};
use crate::parse::log::Log;
use crate::parse::shape::ShapeSpec;
use crate::xml::{self, Element};

/// Relative enlargement of written spheres, so that they still cover the shape after the rounding
/// of any reader.
const ROUNDING: f64 = 1e-9;

/// Options of the covering by spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereOptions {
    /// Largest number of spheres of a link, 1 to 10,000.
    pub most: PerLink<usize>,
    /// Share of the outer surface of a link that is covered at least, by area: above 0, at most 1. `None`
    /// is 1 without a weight, and no bound with one.
    pub coverage: PerLink<Option<f64>>,
    /// Weight of coverage against volume outside the link, 0 to 1: 1 covers all, less leaves out what costs
    /// more volume outside than it covers. `None` takes the set that reaches the least far outside.
    pub weight: PerLink<Option<f64>>,
    /// Spheres that extend at most this far outside a link are not divided: a fraction of the
    /// link's diagonal.
    pub error: f64,
    /// How trees are built.
    pub tree: TreeSettings,
    /// The cache of trees.
    pub cache: TreeCache,
    /// How the URDF is read.
    pub urdf: UrdfOptions,
}

/// A value for all links, and others for some.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PerLink<T> {
    /// The value of the links that are not named.
    pub common: T,
    /// Values by the name of the link.
    pub links: BTreeMap<String, T>,
}

impl<T: Copy> PerLink<T> {
    /// Returns the same value for all links.
    pub fn all(common: T) -> PerLink<T> {
        PerLink { common, links: BTreeMap::new() }
    }

    fn values(&self) -> impl Iterator<Item = &T> {
        self.links.values().chain([&self.common])
    }

    /// Returns the value of a link.
    pub fn of(&self, link: &str) -> T {
        self.links.get(link).copied().unwrap_or(self.common)
    }
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
    /// All links, a parent before its children.
    pub(super) tree: Vec<TreeLink>,
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
    /// Upper bound of the distance by which each extends outside the shapes of the link, meters.
    pub outward: Vec<f64>,
    /// Share of the outer surface, by area, that is proved to lie inside the spheres: 1, or with a
    /// smaller [`SphereOptions::coverage`] or a weight that of the pieces that lie in one sphere.
    pub coverage: f64,
    /// Mean by area of the distance by which the exposed surface of the spheres is outside the shapes of
    /// the link, meters; 0 where it is inside. Sampled.
    pub mean_outward: f64,
    /// Volume of the union of the shapes, m³. Sampled.
    pub volume: f64,
    /// Volume of the union of the spheres outside the shapes, m³. Sampled.
    pub volume_outside: f64,
}

/// A collision element, and its shape in the frame of the link.
struct Part<'a, 'd> {
    node: Node<'a, 'd>,
    form: Form,
}

/// Reads a robot and covers its links by spheres. `progress` receives the fraction of links that
/// are done.
///
/// # Errors
/// [`UrdfError`]: as [`load`](super::load), meshes that cannot be read, numbers out of range, and values for links
/// without collision geometry.
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
    check_links(&elements, options).map_err(wrong)?;
    let (mut links, mut edits) = (Vec::new(), Vec::new());
    for (n, link) in elements.iter().enumerate() {
        let name = link.text("name").unwrap_or("").to_owned();
        let parts = parts(link, &mut context).map_err(|why| wrong(format!("link \"{name}\": {why}")))?;
        if !parts.is_empty() {
            let (nodes, forms): (Vec<Node>, Vec<Form>) = parts.into_iter().map(|part| (part.node, part.form)).unzip();
            let weight = options.weight.of(&name);
            let coverage = options.coverage.of(&name).unwrap_or(if weight.is_some() { 0.0 } else { 1.0 });
            let fit = fit(&forms, options.most.of(&name), Aim { coverage, weight }, options)
                .map_err(|why| wrong(format!("link \"{name}\": {why}")))?;
            let figures = Solid::of(&forms).measure(&fit.spheres);
            links.push(written(name, &nodes, &fit, &figures, &text, &mut edits).map_err(wrong)?);
        }
        progress.report((n + 1) as f64 / elements.len() as f64);
    }
    let tree = self_collision::tree(&robot, links.iter().map(|link| link.name.as_str()));
    let notes = robot.notes.into_iter().chain(context.notes.take()).collect();
    Ok(SphereRobot { name: robot.name, text: edited(&text, edits), links, notes, tree })
}

/// Largest number of spheres of a link.
const MAX_SPHERES: usize = 10_000;

/// Checks the numbers, and that the links with values of their own exist.
fn check_links(elements: &[Element<'_, '_>], options: &SphereOptions) -> Result<(), String> {
    let names: Vec<&str> = elements
        .iter()
        .filter(|link| link.children("collision").next().is_some())
        .filter_map(|link| link.text("name"))
        .collect();
    if let Some(most) = options.most.values().find(|most| !(1..=MAX_SPHERES).contains(*most)) {
        return Err(format!("{most} spheres for a link; expected 1 to {MAX_SPHERES}"));
    }
    if let Some(coverage) = options.coverage.values().flatten().find(|share| !(**share > 0.0 && **share <= 1.0)) {
        return Err(format!("a coverage of {coverage}; expected a share above 0 and at most 1"));
    }
    if let Some(weight) = options.weight.values().flatten().find(|weight| !(0.0..=1.0).contains(*weight)) {
        return Err(format!("a weight of {weight}; expected 0 (no volume outside) to 1 (full coverage)"));
    }
    let mut named = options.most.links.keys().chain(options.coverage.links.keys()).chain(options.weight.links.keys());
    match named.find(|link| !names.contains(&link.as_str())) {
        Some(link) => {
            Err(format!("there is no link \"{link}\" with collision geometry; the links are {}", names.join(", ")))
        }
        None => Ok(()),
    }
}

/// Returns the collision elements of a link, without those that the options leave out.
fn parts<'a, 'd>(link: &Element<'a, 'd>, context: &mut Context<'_>) -> Result<Vec<Part<'a, 'd>>, String> {
    let mut parts = Vec::new();
    for element in link.children("collision") {
        let Some(shape) = read_shape(&element, true, context) else { continue };
        parts.push(Part { node: element.node(), form: form(&shape, context)? });
    }
    Ok(parts)
}

/// Returns the shape in the frame of the link.
fn form(shape: &LinkShape, context: &mut Context<'_>) -> Result<Form, String> {
    let pose = shape.pose;
    match &shape.geometry {
        Geometry::Shape(ShapeSpec::Sphere { radius_m }) => Ok(Form::Capsule { radius: *radius_m, length: 0.0, pose }),
        Geometry::Shape(ShapeSpec::Capsule { radius_m, length_m }) => {
            Ok(Form::Capsule { radius: *radius_m, length: *length_m, pose })
        }
        Geometry::Shape(ShapeSpec::Box { size_m }) => {
            Ok(Form::Mesh { given: placed(TriMesh::cuboid(Vec3::from(*size_m)), &pose), closed: None })
        }
        Geometry::Shape(ShapeSpec::Cylinder { radius_m, length_m }) => {
            Ok(Form::Cylinder { radius: *radius_m, length: *length_m, pose })
        }
        Geometry::Shape(other) => Err(format!("{other:?} is not a shape of a URDF")),
        Geometry::Solid { name, .. } => Err(format!("{name} is not a shape of a URDF")),
        Geometry::File { path, scale, hull, .. } => {
            let given = read_file(path)
                .map(|mesh| stretched(mesh, *scale))
                .map_err(|why| format!("{}: {why}", path.display()))?;
            let (solid, note) = solid_of(&given, *hull).map_err(|e| format!("{}: {e}", path.display()))?;
            note.into_iter().for_each(|note| context.notes.add(path.display().to_string(), note));
            // what is closed already may have been wound or welded anew
            let closed = (*hull || given.clone().check_closed().is_err()).then(|| placed(solid.clone(), &pose));
            Ok(Form::Mesh { given: placed(if closed.is_some() { given } else { solid }, &pose), closed })
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

/// Returns the spheres of a link and the edits of the text.
fn written(
    name: String,
    nodes: &[Node<'_, '_>],
    fit: &Fit,
    figures: &Figures,
    text: &str,
    edits: &mut Vec<(Range<usize>, String)>,
) -> Result<LinkSpheres, String> {
    let mut link = LinkSpheres {
        name,
        shapes: nodes.len(),
        spheres: Vec::new(),
        outward: Vec::new(),
        coverage: fit.coverage,
        mean_outward: figures.mean_outward,
        volume: figures.volume,
        volume_outside: figures.volume_outside,
    };
    for (shape, node) in nodes.iter().enumerate() {
        let own = || fit.spheres.iter().filter(|sphere| sphere.shape == shape);
        let more = |s: &FittedSphere| if s.exact { 0.0 } else { ROUNDING * (s.radius + s.center.norm()) };
        let spheres: Vec<(Vec3, f64)> = own().map(|s| (s.center, s.radius + more(s))).collect();
        if !own().any(|sphere| sphere.exact) {
            let range = node.range();
            if text.get(range.clone()).is_none_or(|own| !own.starts_with("<collision")) {
                return Err(format!(
                    "link \"{}\": a <collision> comes from an entity and cannot be replaced; write it out",
                    link.name
                ));
            }
            edits.push((range, elements(node, &spheres, text)));
        }
        link.spheres.extend(spheres);
        link.outward.extend(own().map(|sphere| sphere.outward + more(sphere)));
    }
    Ok(link)
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
