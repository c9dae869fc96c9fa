//! Default appearance of bodies that are added by a program.

use tumble::collide::Shape;
use tumble::dynamics::{Appearance, Renderable, RigidBody as Rigid};

/// Colors that new bodies take in turn, sRGB.
const PALETTE: [[f32; 3]; 7] = [
    [0.84, 0.37, 0.23],
    [0.20, 0.49, 0.72],
    [0.93, 0.71, 0.22],
    [0.30, 0.62, 0.42],
    [0.55, 0.38, 0.66],
    [0.22, 0.64, 0.68],
    [0.80, 0.46, 0.60],
];

/// Returns the `count`th color of new bodies, sRGB.
pub fn palette(count: usize) -> [f32; 3] {
    PALETTE[count % PALETTE.len()]
}

/// Returns a body with its default appearance: the `count`th color. Planes have a gray checkerboard
/// of half a meter; other static geometry is gray.
pub fn usual(body: Rigid, count: usize) -> Rigid {
    let plane = matches!(body.shape(), Shape::HalfSpace);
    let appearance = match (plane, body.is_fixed()) {
        (true, _) => Appearance {
            color: [0.62, 0.64, 0.66],
            roughness: 0.8,
            shader: "checker".into(),
            properties: [("second_r", 0.50), ("second_g", 0.52), ("second_b", 0.54), ("scale_m", 0.5)]
                .map(|(key, value)| (key.into(), value))
                .to_vec(),
            ..Appearance::default()
        },
        (_, true) => return body,
        _ => Appearance { color: palette(count), ..Appearance::default() },
    };
    looking(body, appearance)
}

/// Returns the body in a plain color, sRGB, each 0 to 1.
pub fn colored(body: Rigid, color: [f64; 3]) -> Rigid {
    looking(body, Appearance { color: color.map(|c| c as f32), ..Appearance::default() })
}

/// Returns the body with an appearance.
pub fn looking(body: Rigid, appearance: Appearance) -> Rigid {
    let visuals = body
        .visuals()
        .iter()
        .cloned()
        .map(|visual| tumble::dynamics::Visual { appearance: appearance.clone(), ..visual })
        .collect();
    body.with_visuals(visuals)
}

/// Returns the color of its first visual.
pub fn color(body: &Rigid) -> [f64; 3] {
    body.visuals().first().map_or([0.0; 3], |visual| visual.appearance.color.map(f64::from))
}
