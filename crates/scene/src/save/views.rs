//! `[world]`, `[materials.NAME]` and what the scene is drawn with.

use tumble_core::collide::ContactMode;
use tumble_core::{Combine, Settings};

use super::Writer;
use super::surface::{appearance_spec, contact};
use super::text::Table;
use crate::parse::appearance::AppearanceSpec;
use crate::parse::view::{CameraSpec, CavePlace, GroundSpec, LightKind, LightSpec, SkySpec};
use crate::parse::world::{Integrator, Solver, Stepper, WorldSettings};

impl Writer<'_> {
    /// Writes `[world]`.
    pub(super) fn world_table(&mut self) {
        let (s, absent): (&Settings, _) = (self.world.settings(), WorldSettings::default());
        let mut t = Table::of("gravity_m_per_s2", s.gravity);
        t.put("dt_s", s.dt);
        t.put_unless(absent.substeps, "substeps", s.substeps);
        t.put_unless(absent.duration_s, "duration_s", self.like.world.duration_s);
        self.choice(&mut t, "stepper", Stepper::NAMES, self.world.stepper_name());
        let integrator = Integrator::NAMES.iter().find(|(_, i)| tumble_core::Integrator::from(*i) == s.integrator);
        integrator.into_iter().for_each(|(name, _)| t.put_unless("verlet", "integrator", *name));
        t.put_unless(absent.integrator_tolerance, "integrator_tolerance", s.integrator_tolerance);
        self.choice(&mut t, "solver", Solver::NAMES, self.world.solver_name());
        t.put_unless(absent.iterations, "iterations", s.solver_settings.max_sweeps);
        s.solver_settings.budget.iter().for_each(|budget| t.put("budget", *budget));
        t.put_unless(absent.contact_tolerance_m, "contact_tolerance_m", s.contact_tolerance);
        if let Some(sleep) = &s.sleep {
            t.put("sleep_after_s", sleep.after);
            t.put("sleep_within_m", sleep.within);
        }
        let rule = |rule: Combine| Combine::NAMES.iter().find(|(_, r)| *r == rule).map_or("", |(name, _)| *name);
        t.put_unless(rule(absent.combine_restitution), "combine_restitution", rule(s.combine_restitution));
        t.put_unless(rule(absent.combine_friction), "combine_friction", rule(s.combine_friction));
        t.put_unless(absent.event_impulse_n_s, "event_impulse_n_s", s.event_impulse);
        t.put_unless(absent.max_turn_rad, "max_turn_rad", s.max_turn);
        t.put_unless(
            Settings::default().drift_tolerance.max(s.contact_tolerance),
            "drift_tolerance_m",
            s.drift_tolerance,
        );
        t.put_unless(absent.recovery_speed_m_per_s, "recovery_speed_m_per_s", s.recovery_speed);
        t.put_unless(absent.projection_sweeps, "projection_sweeps", s.projection_sweeps);
        t.put_unless(absent.stabilize_positions, "stabilize_positions", s.stabilize_positions);
        t.put_unless(absent.solver_tolerance_m_per_s, "solver_tolerance_m_per_s", s.solver_settings.tolerance);
        t.put_unless(absent.max_relaxations, "max_relaxations", s.solver_settings.max_relaxations);
        t.put_unless(absent.threads, "threads", s.threads);
        debug_assert_eq!(absent.contacts, ContactMode::Surface, "bodies are written with this default");
        self.out += &t.under("[world]");
    }

    fn choice<T>(&mut self, t: &mut Table, key: &'static str, names: &[(&str, T)], name: &'static str) {
        match names.iter().position(|(known, _)| *known == name) {
            Some(0) => {}
            Some(_) => t.put(key, name),
            None => self.fault(format!("the {key} '{name}', which is of another crate")),
        }
    }

    pub(super) fn material_tables(&mut self) {
        for (_, spec) in &self.materials {
            let mut t = contact(&spec.contact, &Default::default());
            t.extend(appearance_spec(&spec.appearance, &AppearanceSpec::default()));
            spec.sound.iter().for_each(|sound| t.put("sound", sound));
            self.out += &t.under(&format!("[materials.{}]", serde_json::Value::from(spec.name.as_str())));
        }
    }

    /// Writes camera, cave, lights, sky and ground.
    pub(super) fn views(&mut self) {
        let like = self.like;
        if let Some(CameraSpec { eye_m, target_m, up, vertical_fov_deg, near_m, far_m }) = &like.camera {
            let mut t = Table::of("eye_m", *eye_m);
            t.put("target_m", *target_m);
            t.put("up", *up);
            t.put("vertical_fov_deg", *vertical_fov_deg);
            t.put("near_m", *near_m);
            t.put("far_m", *far_m);
            self.out += &t.under("[camera]");
        }
        if let Some(CavePlace { origin_m, heading_deg, scale }) = &like.cave {
            let mut t = Table::of("origin_m", *origin_m);
            t.put("heading_deg", *heading_deg);
            t.put("scale", *scale);
            self.out += &t.under("[cave]");
        }
        for LightSpec { kind, color, intensity, casts_shadow } in &like.lights {
            let mut t = match kind {
                LightKind::Directional { direction } => {
                    let mut t = Table::of("type", "directional");
                    t.put("direction", *direction);
                    t
                }
                LightKind::Point { position_m } => {
                    let mut t = Table::of("type", "point");
                    t.put("position_m", *position_m);
                    t
                }
            };
            t.put("color", *color);
            t.put("intensity", *intensity);
            t.put("casts_shadow", *casts_shadow);
            self.out += &t.under("[[light]]");
        }
        let SkySpec { zenith_color, horizon_color, nadir_color, intensity } = &like.sky;
        let mut t = Table::of("zenith_color", *zenith_color);
        t.put("horizon_color", *horizon_color);
        t.put("nadir_color", *nadir_color);
        t.put("intensity", *intensity);
        self.out += &t.under("[sky]");
        if let Some(GroundSpec { height_m, appearance }) = &like.ground {
            let mut t = Table::of("height_m", *height_m);
            t.extend(appearance_spec(appearance, &GroundSpec::default_appearance()));
            self.out += &t.under("[ground]");
        }
    }
}
