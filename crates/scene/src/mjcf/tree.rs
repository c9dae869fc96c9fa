//! `<worldbody>`: the bodies of a model with their joints, geoms, sites, cameras and lights. Frames
//! are resolved and repeated bodies written out.

use nalgebra::Translation3;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Mat3, Pose, Vec3};

use super::Reader;
use super::compiler::FromGeoms;
use super::defaults::cleaned;
use super::geom::{Geom, placed};
use super::joint::JointItem;
use super::schema;
use super::source::XmlNode;
use crate::parse::bound::Bound;
use crate::parse::link::inertia_fault;
use crate::xml::Element;

/// Largest number of bodies of a model.
const MAX_BODIES: usize = 100_000;
/// Largest number of geoms, joints, sites, cameras and lights of a model.
const MAX_PARTS: usize = 500_000;

/// A body in its reference configuration. Body 0 is the world.
pub(super) struct Body<'a> {
    pub(super) name: Option<String>,
    pub(super) element: Element<'a, 'a>,
    pub(super) parent: usize,
    /// In the frame of its parent.
    pub(super) pose: Pose,
    pub(super) joints: Vec<JointItem<'a>>,
    pub(super) geoms: Vec<Geom<'a>>,
    pub(super) inertial: Option<(Element<'a, 'a>, LinkMass)>,
    pub(super) sites: Vec<Frame<'a>>,
    pub(super) cameras: Vec<Camera<'a>>,
    pub(super) lights: Vec<Light<'a>>,
    pub(super) mocap: bool,
    pub(super) gravity_scale: f64,
}

/// A named frame on a body.
pub(super) struct Frame<'a> {
    pub(super) name: Option<String>,
    pub(super) element: Element<'a, 'a>,
    pub(super) pose: Pose,
    /// Volume of a site, for touch sensors.
    pub(super) volume: Option<crate::parse::shape::ShapeSpec>,
}

/// A camera on a body: it looks along its −z axis, and y is up in the image.
pub(super) struct Camera<'a> {
    pub(super) frame: Frame<'a>,
    /// Vertical field of view, degrees.
    pub(super) fovy: f64,
}

/// A light on a body.
pub(super) struct Light<'a> {
    pub(super) element: Element<'a, 'a>,
    pub(super) position: Vec3,
    pub(super) direction: Vec3,
    pub(super) directional: bool,
    pub(super) color: [f64; 3],
    pub(super) casts_shadow: bool,
}

/// The place of elements that are being read.
struct Around<'p> {
    body: usize,
    /// Pose of the `<frame>` in the body.
    frame: Pose,
    /// Default class of elements without their own.
    class: usize,
    /// Appended to all names.
    suffix: &'p str,
}

/// Reads all bodies, in the order of the file: parents before children.
pub(super) fn read<'a>(root: &XmlNode<'a>, reader: &Reader<'a>) -> Vec<Body<'a>> {
    let mut tree = Tree { reader, bodies: vec![Body::new(root.element, None, 0, Pose::identity())], parts: 0 };
    for world in root.all("worldbody") {
        tree.fill(world, &Around { body: 0, frame: Pose::identity(), class: 0, suffix: "" });
    }
    tree.bodies
}

struct Tree<'r, 'a> {
    reader: &'r Reader<'a>,
    bodies: Vec<Body<'a>>,
    parts: usize,
}

impl<'a> Body<'a> {
    fn new(element: Element<'a, 'a>, name: Option<String>, parent: usize, pose: Pose) -> Body<'a> {
        Body {
            name,
            element,
            parent,
            pose,
            joints: Vec::new(),
            geoms: Vec::new(),
            inertial: None,
            sites: Vec::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            mocap: false,
            gravity_scale: 1.0,
        }
    }
}

impl<'a> Tree<'_, 'a> {
    /// Reads the children of a body, a frame or the world.
    fn fill(&mut self, node: &XmlNode<'a>, around: &Around<'_>) {
        let (reader, to) = (self.reader, around.body);
        for child in &node.children {
            let element = child.element;
            if reader.log_is_full(&element) || !self.has_room(&element) {
                return;
            }
            let class = around.class;
            match element.tag() {
                "body" => self.body(child, around),
                "frame" => {
                    schema::FRAME.check(&element, &reader.notes);
                    let pose = around.frame * reader.compiler.pose(&reader.classes.item(element, 0));
                    let class = reader.classes.named(&element, "childclass").unwrap_or(class);
                    self.fill(child, &Around { frame: pose, class, ..*around });
                }
                "replicate" => self.replicate(child, around),
                "joint" | "freejoint" if to == 0 => element.problem("is in the world", "expected it in a <body>"),
                "joint" | "freejoint" => {
                    let joint = JointItem::read(element, class, &around.frame, reader);
                    self.bodies[to].joints.push(named(joint, around.suffix, |joint| &mut joint.name));
                }
                "geom" => {
                    let geom = Geom::read(element, class, &around.frame, reader);
                    self.bodies[to].geoms.extend(geom.map(|geom| named(geom, around.suffix, |geom| &mut geom.name)));
                }
                "inertial" => self.inertial(element, around),
                "site" => {
                    schema::SITE.check(&element, &reader.notes);
                    let item = reader.classes.item(element, class);
                    let pose = around.frame * placed(&item, reader).0;
                    let size = item.list("size", 3).unwrap_or_default();
                    let volume = super::sensor::volume(item.text("type").unwrap_or("sphere"), &size);
                    let site = Frame { name: item.name(), element, pose, volume };
                    self.bodies[to].sites.push(named(site, around.suffix, |site| &mut site.name));
                }
                "camera" => self.camera(element, around),
                "light" => self.light(element, around),
                tag => reader.notes.add(&element, format!("<{}> is left out", cleaned(tag))),
            }
        }
    }

    fn has_room(&mut self, element: &Element<'_, '_>) -> bool {
        self.parts += 1;
        if self.parts == MAX_PARTS || self.bodies.len() == MAX_BODIES {
            let expected = format!("expected at most {MAX_BODIES} bodies and {MAX_PARTS} elements in all");
            element.problem("is one too many", expected);
            self.parts = MAX_PARTS;
        }
        self.parts < MAX_PARTS
    }

    fn body(&mut self, node: &XmlNode<'a>, around: &Around<'_>) {
        let (reader, element) = (self.reader, node.element);
        schema::BODY.check(&element, &reader.notes);
        let item = reader.classes.item(element, 0);
        let class = reader.classes.named(&element, "childclass").unwrap_or(around.class);
        let pose = around.frame * reader.compiler.pose(&item);
        let mut body = named(Body::new(element, item.name(), around.body, pose), around.suffix, |body| &mut body.name);
        body.mocap = item.flag("mocap", false);
        body.gravity_scale = 1.0 - item.number("gravcomp", Bound::ANY, 0.0);
        if body.mocap && around.body != 0 {
            element.wrong("mocap", "false: only a child of the world can be a mocap body");
        }
        self.bodies.push(body);
        let number = self.bodies.len() - 1;
        self.fill(node, &Around { body: number, frame: Pose::identity(), class, suffix: around.suffix });
        let body = &self.bodies[number];
        let free = body.joints.iter().any(|joint| joint.kind == super::joint::Kind::Free);
        if free && (around.body != 0 || body.joints.len() > 1) {
            element.problem("has a free joint", "expected it as the only joint of a child of the world");
        }
    }

    /// Writes out the children of `<replicate>`, each time one step further.
    fn replicate(&mut self, node: &XmlNode<'a>, around: &Around<'_>) {
        let (reader, element) = (self.reader, node.element);
        schema::REPLICATE.check(&element, &reader.notes);
        let item = reader.classes.item(element, 0);
        let bound = Bound::new(1.0, 10_000.0, "a whole number from 1 to 10000");
        element.required_text("count", bound.expected());
        let count = item.number("count", bound, 1.0) as usize;
        let offset = Translation3::from(Vec3::from(item.numbers("offset").unwrap_or([0.0; 3])));
        let step = Pose::from_parts(offset, reader.compiler.orientation(&item));
        let class = reader.classes.named(&element, "childclass").unwrap_or(around.class);
        let digits = (count.max(2) - 1).to_string().len();
        let mut frame = around.frame;
        for k in 0..count {
            let suffix = format!("{}{}{k:0digits$}", around.suffix, cleaned(element.text("sep").unwrap_or("")));
            self.fill(node, &Around { frame, class, suffix: &suffix, ..*around });
            if self.parts >= MAX_PARTS {
                return;
            }
            frame *= step;
        }
    }

    fn inertial(&mut self, element: Element<'a, 'a>, around: &Around<'_>) {
        let reader = self.reader;
        schema::INERTIAL.check(&element, &reader.notes);
        let item = reader.classes.item(element, 0);
        let pose = around.frame * reader.compiler.pose(&item);
        let mass = element.required_number("mass", Bound::NOT_NEGATIVE);
        let diagonal = element.numbers("diaginertia", Bound::NOT_NEGATIVE);
        let full = element.numbers::<6>("fullinertia", Bound::ANY);
        let inertia = match (diagonal, full) {
            (Some(_), Some(_)) => {
                return element.problem("has `diaginertia` and `fullinertia`", "expected one of them");
            }
            (Some(moments), None) => Mat3::from_diagonal(&Vec3::from(moments)),
            (None, Some([xx, yy, zz, xy, xz, yz])) => Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            (None, None) => Mat3::zeros(),
        };
        if !mass.is_finite() || inertia.iter().any(|x| !x.is_finite()) {
            return;
        }
        // `mass.rs` checks it if the geoms come first and there are none
        let is_checked = !reader.compiler.balance && reader.compiler.from_geoms != FromGeoms::Always;
        if let Some(fault) = inertia_fault(&inertia).filter(|_| is_checked) {
            let given = if full.is_some() { "fullinertia" } else { "diaginertia" };
            element.wrong(given, fault);
        }
        if around.body == 0 || self.bodies[around.body].inertial.is_some() {
            element.problem("is not the first of a body", "expected one <inertial> in a body, none in the world");
        }
        let own = LinkMass { mass, center: Vec3::zeros(), inertia };
        self.bodies[around.body].inertial = Some((element, own.seen_from(&pose)));
    }

    fn camera(&mut self, element: Element<'a, 'a>, around: &Around<'_>) {
        let reader = self.reader;
        schema::CAMERA.check(&element, &reader.notes);
        let item = reader.classes.item(element, around.class);
        if item.text("mode").is_some_and(|mode| mode != "fixed") {
            reader.notes.add(&element, "cameras and lights that follow something are fixed to their bodies");
        }
        let pose = around.frame * reader.compiler.pose(&item);
        let frame =
            named(Frame { name: item.name(), element, pose, volume: None }, around.suffix, |frame| &mut frame.name);
        let fovy = item.number("fovy", Bound::new(0.1, 179.0, "an angle from 0.1 to 179 degrees"), 45.0);
        self.bodies[around.body].cameras.push(Camera { frame, fovy: fovy.clamp(1.0, 170.0) });
    }

    fn light(&mut self, element: Element<'a, 'a>, around: &Around<'_>) {
        let reader = self.reader;
        schema::LIGHT.check(&element, &reader.notes);
        let item = reader.classes.item(element, around.class);
        if item.text("mode").is_some_and(|mode| mode != "fixed") {
            reader.notes.add(&element, "cameras and lights that follow something are fixed to their bodies");
        }
        let directional = item.text("type") == Some("directional") || item.flag("directional", false);
        let position = Vec3::from(item.numbers("pos").unwrap_or([0.0; 3]));
        let direction = Vec3::from(item.numbers("dir").unwrap_or([0.0, 0.0, -1.0]));
        let light = Light {
            element,
            position: around.frame.transform_point(&position.into()).coords,
            direction: around.frame.rotation * direction.try_normalize(1e-10).unwrap_or(-Vec3::z()),
            directional,
            color: item.numbers("diffuse").unwrap_or([0.7; 3]).map(|x| x.clamp(0.0, 1.0)),
            casts_shadow: item.flag("castshadow", true),
        };
        if item.flag("active", true) {
            self.bodies[around.body].lights.push(light);
        }
    }
}

/// Appends a suffix to a name, if there are both.
fn named<T>(mut item: T, suffix: &str, name: impl Fn(&mut T) -> &mut Option<String>) -> T {
    if let Some(name) = name(&mut item) {
        name.push_str(suffix);
    }
    item
}
