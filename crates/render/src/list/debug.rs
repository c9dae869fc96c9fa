//! Debug drawing: contact points, normals, velocities, forces, sphere trees (thesis §IV.B.3, the
//! detector's `Render`).

use super::DrawList;
use nalgebra::{Point3, Vector3};

/// Color and layering of a debug drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DebugStyle {
    /// sRGB.
    pub color: [f32; 3],
    /// 1 is solid, 0 invisible.
    pub opacity: f32,
    /// Width of lines, diameter of points, pixels.
    pub width_px: f32,
    /// Whether it is drawn over everything, instead of being hidden by objects in front.
    pub on_top: bool,
}

impl DebugStyle {
    /// Solid, 2 pixels wide, hidden by objects in front.
    pub fn new(color: [f32; 3]) -> Self {
        DebugStyle { color, opacity: 1.0, width_px: 2.0, on_top: false }
    }

    /// Sets it to be drawn over everything.
    #[must_use]
    pub fn on_top(mut self) -> Self {
        self.on_top = true;
        self
    }

    /// Sets the width, pixels.
    #[must_use]
    pub fn width(mut self, px: f32) -> Self {
        self.width_px = px;
        self
    }

    /// Sets the opacity.
    #[must_use]
    pub fn opacity(mut self, opacity: f32) -> Self {
        self.opacity = opacity;
        self
    }
}

/// A line, or an arrow from `start` to `end`.
#[derive(Clone, Debug, PartialEq)]
pub struct DebugLine {
    /// One end.
    pub start: Point3<f32>,
    /// The other end; the tip of an arrow.
    pub end: Point3<f32>,
    /// Length of the arrow's head, m; 0 for a plain line.
    pub head_m: f32,
    /// Color and layering.
    pub style: DebugStyle,
}

/// A round dot.
#[derive(Clone, Debug, PartialEq)]
pub struct DebugPoint {
    /// Position in the world.
    pub position: Point3<f32>,
    /// Color and layering; the width is the diameter.
    pub style: DebugStyle,
}

/// A sphere of a sphere tree.
#[derive(Clone, Debug, PartialEq)]
pub struct DebugSphere {
    /// Center.
    pub center: Point3<f32>,
    /// Radius, m.
    pub radius: f32,
    /// Rings or shell.
    pub kind: SphereStyle,
    /// Color and layering; `on_top` and the width apply to rings only.
    pub style: DebugStyle,
}

/// How a debug sphere is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SphereStyle {
    /// Three great circles along the world axes.
    Rings,
    /// A translucent shell, clearer in the middle than at the rim.
    Shell,
}

/// Straight pieces per great circle.
const RING_PIECES: usize = 48;

impl DrawList {
    /// Adds a line.
    pub fn line(&mut self, start: Point3<f32>, end: Point3<f32>, style: DebugStyle) {
        self.lines.push(DebugLine { start, end, head_m: 0.0, style });
    }

    /// Adds an arrow from `start` along `vector`, m; its head takes a quarter of it.
    pub fn arrow(&mut self, start: Point3<f32>, vector: Vector3<f32>, style: DebugStyle) {
        self.lines.push(DebugLine { start, end: start + vector, head_m: 0.25 * vector.norm(), style });
    }

    /// Adds a dot.
    pub fn point(&mut self, position: Point3<f32>, style: DebugStyle) {
        self.points.push(DebugPoint { position, style });
    }

    /// Adds a sphere as three rings.
    pub fn wire_sphere(&mut self, center: Point3<f32>, radius: f32, style: DebugStyle) {
        self.debug_spheres.push(DebugSphere { center, radius, kind: SphereStyle::Rings, style });
    }

    /// Adds a sphere as a translucent shell.
    pub fn shell(&mut self, center: Point3<f32>, radius: f32, style: DebugStyle) {
        self.debug_spheres.push(DebugSphere { center, radius, kind: SphereStyle::Shell, style });
    }
}

/// A straight stroke whose width may change along it; all debug lines are made of strokes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stroke {
    pub start: Point3<f32>,
    pub end: Point3<f32>,
    pub start_px: f32,
    pub end_px: f32,
    pub round: bool,
    pub style: DebugStyle,
}

/// Returns all strokes of a list, in its order.
pub(crate) fn strokes(list: &DrawList) -> Vec<Stroke> {
    let mut out = Vec::new();
    list.debug_spheres.iter().filter(|s| s.kind == SphereStyle::Rings).for_each(|s| ring_strokes(s, &mut out));
    list.lines.iter().for_each(|l| line_strokes(l, &mut out));
    list.points.iter().for_each(|p| {
        let px = p.style.width_px;
        out.push(Stroke { start: p.position, end: p.position, start_px: px, end_px: px, round: true, style: p.style });
    });
    out
}

fn line_strokes(line: &DebugLine, out: &mut Vec<Stroke>) {
    let px = line.style.width_px;
    let length = (line.end - line.start).norm();
    let head = line.head_m.min(length);
    let stroke =
        |start, end, start_px, end_px| Stroke { start, end, start_px, end_px, round: false, style: line.style };
    if head <= 0.0 {
        out.push(stroke(line.start, line.end, px, px));
        return;
    }
    let neck = line.end - (line.end - line.start) * (head / length);
    out.push(stroke(line.start, neck, px, px));
    out.push(stroke(neck, line.end, 4.5 * px, 0.0));
}

fn ring_strokes(sphere: &DebugSphere, out: &mut Vec<Stroke>) {
    let px = sphere.style.width_px;
    for axis in 0..3 {
        let at = |i: usize| {
            let (sin, cos) = (std::f32::consts::TAU * (i % RING_PIECES) as f32 / RING_PIECES as f32).sin_cos();
            let mut p = sphere.center;
            p[(axis + 1) % 3] += sphere.radius * cos;
            p[(axis + 2) % 3] += sphere.radius * sin;
            p
        };
        out.extend((0..RING_PIECES).map(|i| Stroke {
            start: at(i),
            end: at(i + 1),
            start_px: px,
            end_px: px,
            round: false,
            style: sphere.style,
        }));
    }
}
