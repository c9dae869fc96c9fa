//! `[[field]]`: forces on all bodies, or on those that it names.

use crate::parse::behavior::soft::SoftSpec;
use crate::parse::behavior::{part, unknown_part};
use crate::parse::body::read_name;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::loop_joint::{PartSpec, Parts};

/// Largest number of panels, and of names of `targets`.
const MOST_PANELS: usize = 1_000;
const MOST_TARGETS: usize = 100_000;

/// A force field.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldSpec {
    /// Unique in the scene.
    pub name: String,
    /// Its law.
    pub kind: FieldKind,
    /// Names of the objects that it acts on; `None` for all that move.
    pub targets: Option<Vec<String>>,
    /// Whether it acts. Default true.
    pub enabled: bool,
}

/// The law of a [`FieldSpec`].
#[derive(Clone, Debug, PartialEq)]
pub enum FieldKind {
    /// Drag of moving air.
    Wind {
        /// Velocity of the air, m/s.
        velocity_m_per_s: [f64; 3],
        /// Drag per speed of the linear law, N·s/m; `None` for the quadratic one.
        drag_n_s_per_m: Option<f64>,
        /// Density of the air, kg/m³. Default 1.2.
        density_kg_per_m3: f64,
        /// Drag coefficient. Default 0.47, that of a sphere.
        drag_coefficient: f64,
    },
    /// A point that attracts masses.
    Attractor {
        /// The point, m.
        position_m: [f64; 3],
        /// Strength, m³/s².
        strength_m3_per_s2: f64,
        /// Softening length, m. Default 0.
        softening_m: f64,
    },
    /// An explosion at a time.
    Explosion {
        /// Its center, m.
        position_m: [f64; 3],
        /// Momentum in all directions together, N·s.
        impulse_n_s: f64,
        /// Time, s. Default 0.
        start_s: f64,
        /// Time constant of its decay, s. Default 0.02.
        decay_s: f64,
    },
    /// A fluid below a surface.
    Buoyancy {
        /// A point of the surface, m.
        position_m: [f64; 3],
        /// Density, kg/m³. Default 1000.
        density_kg_per_m3: f64,
        /// Drag per mass of displaced fluid, 1/s. Default 0.
        drag_per_s: f64,
        /// Velocity of the fluid, m/s. Default 0.
        current_m_per_s: [f64; 3],
    },
    /// Lift and drag on panels.
    Panels {
        /// Density of the air, kg/m³. Default 1.2.
        density_kg_per_m3: f64,
        /// Velocity of the air, m/s. Default 0.
        wind_m_per_s: [f64; 3],
        /// The panels.
        panels: Vec<PanelSpec>,
    },
}

/// A flat surface on a part.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelSpec {
    /// The part.
    pub body: PartSpec,
    /// Middle of the panel in the frame of the part, m. Default 0.
    pub point_m: [f64; 3],
    /// Unit normal in the frame of the part. Default z.
    pub normal: [f64; 3],
    /// Area, m².
    pub area_m2: f64,
    /// Slope of the lift, 1/rad. Default 2π.
    pub lift_slope: f64,
    /// Drag coefficient along the panel. Default 0.02.
    pub drag: f64,
}

#[derive(Clone, Copy)]
enum Kind {
    Wind,
    Attractor,
    Explosion,
    Buoyancy,
    Panels,
}

const KINDS: Names<Kind> = &[
    ("wind", Kind::Wind),
    ("attractor", Kind::Attractor),
    ("explosion", Kind::Explosion),
    ("buoyancy", Kind::Buoyancy),
    ("panels", Kind::Panels),
];

impl FieldSpec {
    /// Reads a table. Returns `None`, with the problem recorded, if its type is missing or unknown.
    pub(crate) fn read(f: &mut Fields<'_>, parts: &impl Parts, soft: &[SoftSpec]) -> Option<FieldSpec> {
        let name = read_name(f).unwrap_or_default();
        let kind = match f.choice("type", KINDS)? {
            Kind::Wind => read_wind(f),
            Kind::Attractor => FieldKind::Attractor {
                position_m: f.vector_or("position_m", Bound::ANY, [0.0; 3]),
                strength_m3_per_s2: f.number("strength_m3_per_s2", Bound::ANY),
                softening_m: f.number_or("softening_m", Bound::NOT_NEGATIVE, 0.0),
            },
            Kind::Explosion => FieldKind::Explosion {
                position_m: f.vector_or("position_m", Bound::ANY, [0.0; 3]),
                impulse_n_s: f.number("impulse_n_s", Bound::NOT_NEGATIVE),
                start_s: f.number_or("start_s", Bound::ANY, 0.0),
                decay_s: f.number_or("decay_s", Bound::POSITIVE, 0.02),
            },
            Kind::Buoyancy => FieldKind::Buoyancy {
                position_m: f.vector_or("position_m", Bound::ANY, [0.0; 3]),
                density_kg_per_m3: f.number_or("density_kg_per_m3", Bound::NOT_NEGATIVE, 1000.0),
                drag_per_s: f.number_or("drag_per_s", Bound::NOT_NEGATIVE, 0.0),
                current_m_per_s: f.vector_or("current_m_per_s", Bound::ANY, [0.0; 3]),
            },
            Kind::Panels => {
                let density_kg_per_m3 = f.number_or("density_kg_per_m3", Bound::NOT_NEGATIVE, 1.2);
                let wind_m_per_s = f.vector_or("wind_m_per_s", Bound::ANY, [0.0; 3]);
                let tables = f.tables("panel", MOST_PANELS);
                let panels = tables.into_iter().filter_map(|table| PanelSpec::read(table, parts)).collect();
                FieldKind::Panels { density_kg_per_m3, wind_m_per_s, panels }
            }
        };
        let targets = if matches!(kind, FieldKind::Panels { .. }) { None } else { read_targets(f, parts, soft) };
        Some(FieldSpec { name, kind, targets, enabled: f.flag_or("enabled", true) })
    }
}

fn read_wind(f: &mut Fields<'_>) -> FieldKind {
    let linear = f.optional_number("drag_n_s_per_m", Bound::NOT_NEGATIVE);
    let quadratic = f.value("density_kg_per_m3").is_some() || f.value("drag_coefficient").is_some();
    if linear.is_some() && quadratic {
        let message = format!("{} has both `drag_n_s_per_m` and constants of the quadratic law", f.what);
        f.log.report(
            f.span.clone(),
            message,
            "expected `drag_n_s_per_m`, or `density_kg_per_m3` and `drag_coefficient`",
        );
    }
    FieldKind::Wind {
        velocity_m_per_s: f.vector_or("velocity_m_per_s", Bound::ANY, [0.0; 3]),
        drag_n_s_per_m: linear,
        density_kg_per_m3: f.number_or("density_kg_per_m3", Bound::NOT_NEGATIVE, 1.2),
        drag_coefficient: f.number_or("drag_coefficient", Bound::NOT_NEGATIVE, 0.47),
    }
}

/// Reads the names of bodies, articulated bodies and soft bodies; `None` without the key.
fn read_targets(f: &mut Fields<'_>, parts: &impl Parts, soft: &[SoftSpec]) -> Option<Vec<String>> {
    f.value("targets")?;
    let mut targets = Vec::new();
    let expected = "a list of names of bodies, articulated bodies, cloths and jellies";
    for (name, value) in f.texts("targets", MOST_TARGETS, expected) {
        let body = matches!(parts.part(name), Some(PartSpec::Body(_)));
        if body || parts.articulated(name).is_some() || soft.iter().any(|soft| soft.name == name) {
            targets.push(name.to_owned());
        } else {
            unknown_part(f, "targets", value, name, parts);
        }
    }
    Some(targets)
}

impl PanelSpec {
    fn read(mut f: Fields<'_>, parts: &impl Parts) -> Option<PanelSpec> {
        f.required("body", "the name of a body, or \"OBJECT/LINK\"");
        let body = part(&mut f, "body", parts);
        let panel = |body| PanelSpec {
            body,
            point_m: f.vector_or("point_m", Bound::ANY, [0.0; 3]),
            normal: f.direction_or("normal", [0.0, 0.0, 1.0]),
            area_m2: f.number("area_m2", Bound::NOT_NEGATIVE),
            lift_slope: f.number_or("lift_slope", Bound::NOT_NEGATIVE, std::f64::consts::TAU),
            drag: f.number_or("drag", Bound::NOT_NEGATIVE, 0.02),
        };
        let panel = body.map(panel);
        match panel {
            Some(_) => f.finish(),
            None => f.give_up(),
        }
        panel
    }
}
