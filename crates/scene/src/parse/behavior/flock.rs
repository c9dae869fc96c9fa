//! `[[flock]]` with its `[[flock.group]]`: boids in groups; `[[body_flock]]`: bodies of the scene.

use tumble_behaviors::{Helm, Steering};
use tumble_core::collide::Vec3;

use crate::parse::appearance::AppearanceSpec;
use crate::parse::behavior::unknown_part;
use crate::parse::body::read_name;
use crate::parse::bound::Bound;
use crate::parse::fields::Fields;
use crate::parse::loop_joint::{PartSpec, Parts};

/// Largest number of groups of a flock, and of boids of a group.
const MOST_GROUPS: usize = 1_000;
const MOST_BOIDS: u32 = 20_000;
/// Largest number of bodies of a flock.
const MOST_BODIES: usize = 20_000;
const ANGLE: Bound = Bound::new(0.0, 360.0, "an angle from 0 to 360 degrees");
const WIDE: Bound = Bound::new(1e-6, 360.0, "an angle above 0, up to 360 degrees");

/// A flock.
#[derive(Clone, Debug, PartialEq)]
pub struct FlockSpec {
    /// Unique in the scene.
    pub name: String,
    /// Constants of its forces.
    pub steering: Steering,
    /// Its boids.
    pub groups: Vec<BoidGroupSpec>,
    /// Whether it takes part in the simulation. Default true.
    pub enabled: bool,
}

/// A flock of rigid bodies and of articulated ones with a floating root.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyFlockSpec {
    /// Unique in the scene.
    pub name: String,
    /// Constants of its forces.
    pub steering: Steering,
    /// How its bodies turn to their course.
    pub helm: Helm,
    /// Names of its bodies.
    pub bodies: Vec<String>,
    /// Whether it takes part in the simulation. Default true.
    pub enabled: bool,
}

/// Equal boids of a flock, spread along a helix within a sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct BoidGroupSpec {
    /// Beginning of their names, before `_0`, `_1` and so on; the name of a single one.
    pub name: String,
    /// Number of boids.
    pub count: usize,
    /// Center of the sphere, m.
    pub position_m: [f64; 3],
    /// Radius of the sphere, m. Default 0.
    pub spread_m: f64,
    /// Velocity, world axes, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Mass of a boid, kg. Default 1.
    pub mass_kg: f64,
    /// Radius of the sphere with which a boid collides, m. Default 0.2.
    pub radius_m: f64,
    /// Time that turns a rate of turn into a share of a quarter turn of bank, s. Default 1.
    pub bank_time_s: f64,
    /// Time constant of the roll, s. Default 0.2.
    pub roll_time_s: f64,
    /// Appearance.
    pub appearance: AppearanceSpec,
    /// Whether they take part in contacts. Default true.
    pub collidable: bool,
    /// Whether it takes part in the simulation. Default true.
    pub enabled: bool,
}

impl FlockSpec {
    pub(crate) fn read(f: &mut Fields<'_>) -> FlockSpec {
        let name = read_name(f).unwrap_or_default();
        let steering = read_steering(f);
        let groups = f.tables("group", MOST_GROUPS);
        let groups = groups.into_iter().map(|table| BoidGroupSpec::read(table, &name)).collect();
        FlockSpec { name, steering, groups, enabled: f.flag_or("enabled", true) }
    }
}

/// Reads the constants of the forces.
fn read_steering(f: &mut Fields<'_>) -> Steering {
    let usual = Steering::default();
    let mut angle = |key, bound, usual: f64| f.optional_number(key, bound).map_or(usual, f64::to_radians);
    let visibility_angle = angle("visibility_angle_deg", WIDE, usual.visibility_angle);
    let inner_visibility_angle = angle("inner_visibility_angle_deg", ANGLE, usual.inner_visibility_angle);
    let mut at_least_0 = |key, usual| f.number_or(key, Bound::NOT_NEGATIVE, usual);
    Steering {
        avoidance: at_least_0("avoidance_m2_per_s2", usual.avoidance),
        matching: at_least_0("matching_per_s", usual.matching),
        clustering: at_least_0("clustering_per_s2", usual.clustering),
        max_force: at_least_0("max_force_n", usual.max_force),
        inner_visibility_distance: at_least_0("inner_visibility_distance_m", usual.inner_visibility_distance),
        desired_speed: at_least_0("desired_speed_m_per_s", usual.desired_speed),
        speed_rate: at_least_0("speed_rate_per_s", usual.speed_rate),
        boundary_radius: at_least_0("boundary_radius_m", usual.boundary_radius),
        boundary_stiffness: at_least_0("boundary_stiffness_n_per_m", usual.boundary_stiffness),
        visibility_distance: f.number_or("visibility_distance_m", Bound::POSITIVE, usual.visibility_distance),
        visibility_angle,
        inner_visibility_angle,
        boundary_center: Vec3::from(f.vector_or("boundary_center_m", Bound::ANY, usual.boundary_center.into())),
    }
}

impl BodyFlockSpec {
    pub(crate) fn read(f: &mut Fields<'_>, parts: &impl Parts) -> BodyFlockSpec {
        let name = read_name(f).unwrap_or_default();
        let (steering, usual) = (read_steering(f), Helm::default());
        let mut at_least_0 = |key, usual| f.number_or(key, Bound::NOT_NEGATIVE, usual);
        let helm = Helm {
            agility: at_least_0("agility_per_s", usual.agility),
            max_angular_acceleration: at_least_0("max_angular_acceleration_rad_per_s2", usual.max_angular_acceleration),
            bank_time: at_least_0("bank_time_s", usual.bank_time),
            up: f.value("up").map_or(usual.up, |value| Vec3::from(f.as_direction("up", value))),
            wind: Vec3::from(f.vector_or("wind_m_per_s", Bound::ANY, usual.wind.into())),
        };
        if let Some(up) = f.value("up").filter(|_| helm.up == Vec3::zeros()) {
            f.wrong("up", up, "a direction");
        }
        let mut bodies: Vec<String> = Vec::new();
        if f.value("bodies").is_some() {
            let expected = "a list of names of bodies, and of articulated bodies that float";
            for (body, value) in f.texts("bodies", MOST_BODIES, expected) {
                let articulated = parts.articulated(body);
                if !matches!(parts.part(body), Some(PartSpec::Body(_))) && articulated.is_none() {
                    unknown_part(f, "bodies", value, body, parts);
                } else if articulated.is_some_and(|index| !parts.floats(index)) {
                    f.wrong("bodies", value, "an articulated body with `floating = true`");
                } else if bodies.iter().any(|other| other == body) {
                    f.wrong("bodies", value, "each body once");
                } else {
                    bodies.push(body.to_owned());
                }
            }
        }
        BodyFlockSpec { name, steering, helm, bodies, enabled: f.flag_or("enabled", true) }
    }
}

impl BoidGroupSpec {
    fn read(mut f: Fields<'_>, flock: &str) -> BoidGroupSpec {
        let own = f.value("name").is_some().then(|| read_name(&mut f)).flatten();
        let group = BoidGroupSpec {
            name: own.unwrap_or_else(|| format!("{flock}_boid")),
            count: f.integer_or("count", 1..=MOST_BOIDS, 1) as usize,
            position_m: f.vector_or("position_m", Bound::ANY, [0.0; 3]),
            spread_m: f.number_or("spread_m", Bound::NOT_NEGATIVE, 0.0),
            velocity_m_per_s: f.vector_or("velocity_m_per_s", Bound::ANY, [0.0; 3]),
            mass_kg: f.number_or("mass_kg", Bound::POSITIVE, 1.0),
            radius_m: f.number_or("radius_m", Bound::POSITIVE, 0.2),
            bank_time_s: f.number_or("bank_time_s", Bound::NOT_NEGATIVE, 1.0),
            roll_time_s: f.number_or("roll_time_s", Bound::POSITIVE, 0.2),
            appearance: AppearanceSpec::read(&mut f, &AppearanceSpec::default()),
            collidable: f.flag_or("collidable", true),
            enabled: f.flag_or("enabled", true),
        };
        if group.count > 1 && group.spread_m == 0.0 {
            f.missing("spread_m", "`spread_m` above 0, so that the boids of the group do not start in one place");
        }
        f.finish();
        group
    }

    /// Returns the name of boid `k`.
    pub(crate) fn name_of(&self, k: usize) -> String {
        if self.count == 1 { self.name.clone() } else { format!("{}_{k}", self.name) }
    }

    /// Returns the start of boid `k`, m: on a helix that winds through shells of equal volume.
    pub(crate) fn start(&self, k: usize) -> Vec3 {
        const GOLDEN: f64 = 2.399_963_229_728_653; // π·(3 − √5)
        let share = (k as f64 + 0.5) / self.count as f64;
        // multiples of the golden ratio, modulo 1
        let height = 1.0 - 2.0 * (0.618_033_988_749_894_9 * (k as f64 + 0.5)).fract();
        let around = (1.0 - height * height).max(0.0).sqrt();
        let (sin, cos) = libm::sincos(GOLDEN * k as f64);
        let radius = self.spread_m * libm::cbrt(share);
        Vec3::from(self.position_m) + radius * Vec3::new(around * cos, around * sin, height)
    }
}
