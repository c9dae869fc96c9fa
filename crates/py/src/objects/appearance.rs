//! Appearance of bodies that are added by a program.

use crate::arrays::convert::{path, some};
use crate::errors::{Error, Result};
use pyo3::prelude::*;
use tumble::collide::{Shape, Vec3};
use tumble::dynamics::{Appearance, Renderable, RigidBody as Rigid};
use tumble::scene::{AppearanceSpec, Pattern, check_texture};

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

/// Reads a `tumble.Appearance`.
pub fn given(value: &Bound<'_, PyAny>) -> Result<AppearanceSpec> {
    let field = |name: &str| {
        value.getattr(name).map_err(|_| Error::value("appearance: expected a tumble.Appearance".to_owned()))
    };
    let number = |name: &str, low: f64, high: f64, expected: &str| -> Result<f64> {
        let number: f64 = field(name)?.extract()?;
        let known = number.is_finite() && number >= low && number <= high;
        known
            .then_some(number)
            .ok_or_else(|| Error::value(format!("appearance.{name} is {number}; expected {expected}")))
    };
    let share = |name: &str| number(name, 0.0, 1.0, "0 to 1");
    let color = |name: &str| -> Result<[f64; 3]> {
        let color = some::<3>(&field(name)?, &format!("appearance.{name}"))?;
        match color.iter().find(|share| !(0.0..=1.0).contains(*share)) {
            Some(wrong) => Err(Error::value(format!("appearance.{name}: {wrong} is not from 0 to 1"))),
            None => Ok(color),
        }
    };
    let (pattern, detail): (String, String) = (field("pattern")?.extract()?, field("detail")?.extract()?);
    let texture = field("texture")?;
    let texture = if texture.is_none() { None } else { Some(path(&texture)?) };
    if let Some(file) = &texture {
        let why = match file.is_file() {
            true => check_texture(file).err(),
            false => Some("there is no such file".to_owned()),
        };
        if let Some(why) = why {
            return Err(Error::value(format!("appearance.texture is {}: {why}; expected a PNG file", file.display())));
        }
    }
    Ok(AppearanceSpec {
        color: color("color")?,
        second_color: color("second_color")?,
        pattern: Pattern::by_name(&pattern).ok_or_else(|| {
            let names = Pattern::names().collect::<Vec<_>>().join(", ");
            Error::value(format!("appearance.pattern is '{pattern}'; expected one of {names}"))
        })?,
        pattern_scale_m: number("pattern_scale", f64::MIN_POSITIVE, f64::MAX, "a length above 0, m")?,
        pattern_offset_m: number("pattern_offset", f64::MIN, f64::MAX, "a length, m")?,
        roughness: share("roughness")?,
        metallic: share("metallic")?,
        clearcoat: share("clearcoat")?,
        glow: field("glow")?.extract()?,
        texture,
        detail: detail.parse().map_err(|expected: String| {
            Error::value(format!("appearance.detail is '{detail}'; expected {expected}"))
        })?,
    })
}

/// Returns a description as a `tumble.Appearance`.
pub fn shown<'py>(py: Python<'py>, spec: &AppearanceSpec) -> Result<Bound<'py, PyAny>> {
    let class = py.import("tumble._pictures")?.getattr("Appearance")?;
    let color = |[r, g, b]: [f64; 3]| (r, g, b);
    Ok(class.call1((
        color(spec.color),
        color(spec.second_color),
        spec.pattern.name(),
        spec.pattern_scale_m,
        spec.pattern_offset_m,
        spec.roughness,
        spec.metallic,
        spec.clearcoat,
        spec.glow,
        spec.texture.clone(),
        spec.detail.words(),
    ))?)
}

/// Returns the description of the first visual of a body.
pub fn of(body: &Rigid) -> AppearanceSpec {
    let center = body.shape().center_of_mass();
    body.visuals()
        .first()
        .map_or_else(AppearanceSpec::default, |first| AppearanceSpec::of_body(&first.appearance, &center))
}

/// Returns the body with a described appearance.
pub fn described(body: Rigid, spec: &AppearanceSpec) -> Rigid {
    let center: Vec3 = body.shape().center_of_mass();
    looking(body, spec.in_body(&center))
}
