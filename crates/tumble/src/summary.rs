//! `--summary`: cost and accuracy of a run, as JSON.

use serde::Serialize;
use tumble::dynamics::{Energy, StepReport, UnreachableJoint, World, WorstSolve};

/// The summary. Names carry the units; quaternions are `x, y, z, w`.
#[derive(Serialize)]
pub struct Summary {
    scene: String,
    stepper: &'static str,
    solver: &'static str,
    dt_s: f64,
    steps: u64,
    simulated_s: f64,
    wall_s: f64,
    real_time_factor: f64,
    /// 99 % of the frames took at most this.
    frame_p99_ms: f64,
    frame_max_ms: f64,
    contacts_mean: f64,
    contacts_max: u32,
    solver_residual_max_m_per_s: f64,
    unconverged_solves: u64,
    /// The solve with the largest residual; none if nothing was solved.
    worst_solve: Option<Worst>,
    rays: u64,
    max_penetration_m: f64,
    /// Largest opening of a joint whose sides could not reach each other, and its name; 0 and none
    /// if all could.
    out_of_reach_max_m: f64,
    out_of_reach: Option<String>,
    tries_mean: f64,
    tries_max: u32,
    floor_hits: u64,
    start: State,
    end: State,
    bodies: Vec<Body>,
}

/// The solve of a run with the largest residual.
#[derive(Serialize)]
struct Worst {
    /// End of its frame, simulated time.
    time_s: f64,
    /// Names of the objects, one or two, on which its row with the largest residual acts.
    objects: Vec<String>,
    island_objects: u32,
    island_rows: u32,
    /// Largest residual with which it counts as converged.
    tolerance_m_per_s: f64,
    converged: bool,
}

/// Sums over all dynamic objects at one moment.
#[derive(Serialize)]
pub struct State {
    kinetic_energy_j: f64,
    potential_energy_j: f64,
    linear_momentum_n_s: [f64; 3],
    angular_momentum_n_m_s: [f64; 3],
}

#[derive(Serialize)]
struct Body {
    name: String,
    position_m: [f64; 3],
    orientation_xyzw: [f64; 4],
    asleep: bool,
}

/// Accumulates the reports of a run.
#[derive(Default)]
pub struct Tally {
    steps: u64,
    contacts: u64,
    contacts_max: u32,
    residual: f64,
    /// The solve with this residual, and the number of its frame.
    worst: Option<(WorstSolve, u64)>,
    unconverged: u64,
    rays: u64,
    penetration: f64,
    out_of_reach: Option<UnreachableJoint>,
    tries: u64,
    tries_max: u32,
    floor_hits: u64,
    frames_s: Vec<f64>,
}

impl Tally {
    /// Adds one frame's report and the wall-clock time that it took, s.
    pub fn add(&mut self, report: &StepReport, wall_s: f64) {
        self.steps += 1;
        self.frames_s.push(wall_s);
        self.contacts += report.contacts as u64;
        self.contacts_max = self.contacts_max.max(report.contacts);
        if report.residual > self.residual {
            self.residual = report.residual;
            self.worst = report.worst_solve.map(|worst| (worst, self.steps));
        }
        self.unconverged += report.unconverged as u64;
        self.rays += report.rays as u64;
        self.penetration = self.penetration.max(report.max_penetration);
        let further = |o: &UnreachableJoint| self.out_of_reach.is_none_or(|worst| o.distance > worst.distance);
        self.out_of_reach = report.unreachable_joint.filter(further).or(self.out_of_reach);
        self.tries += report.tries as u64;
        self.tries_max = self.tries_max.max(report.tries);
        self.floor_hits += report.floor_hits as u64;
    }

    /// Returns the time that the fraction `share` of the frames stayed within, ms.
    fn frame_ms(&self, share: f64) -> f64 {
        let mut sorted = self.frames_s.clone();
        sorted.sort_by(f64::total_cmp);
        let last = (share * sorted.len() as f64).ceil() as usize;
        1e3 * sorted.get(last.saturating_sub(1)).copied().unwrap_or(0.0)
    }

    fn per_step(&self, sum: u64) -> f64 {
        sum as f64 / self.steps.max(1) as f64
    }

    /// Returns the summary at the end of a run that took `wall_s` seconds of wall-clock time.
    pub fn summary(&self, scene: &str, world: &World, start: State, simulated_s: f64, wall_s: f64) -> Summary {
        let (stepper, solver) = (world.stepper_name(), world.solver_name());
        let name = |id| world.name(id).map(str::to_string);
        let worst = |(worst, frame): (WorstSolve, u64)| Worst {
            time_s: world.time() - (self.steps - frame) as f64 * world.settings().dt,
            objects: [name(worst.object), worst.other.and_then(name)].into_iter().flatten().collect(),
            island_objects: worst.objects,
            island_rows: worst.rows,
            tolerance_m_per_s: worst.tolerance,
            converged: worst.converged,
        };
        Summary {
            scene: scene.to_string(),
            stepper,
            solver,
            dt_s: world.settings().dt,
            steps: self.steps,
            simulated_s,
            wall_s,
            real_time_factor: simulated_s / wall_s.max(1e-9),
            frame_p99_ms: self.frame_ms(0.99),
            frame_max_ms: self.frame_ms(1.0),
            contacts_mean: self.per_step(self.contacts),
            contacts_max: self.contacts_max,
            solver_residual_max_m_per_s: self.residual,
            unconverged_solves: self.unconverged,
            worst_solve: self.worst.map(worst),
            rays: self.rays,
            max_penetration_m: self.penetration,
            out_of_reach_max_m: self.out_of_reach.map_or(0.0, |o| o.distance),
            out_of_reach: self.out_of_reach.and_then(|o| Some(world.name(o.loop_joint)?.to_string())),
            tries_mean: self.per_step(self.tries),
            tries_max: self.tries_max,
            floor_hits: self.floor_hits,
            start,
            end: State::of(world),
            bodies: bodies(world),
        }
    }
}

impl State {
    /// Sums over the present state.
    pub fn of(world: &World) -> State {
        let (Energy { kinetic, potential }, momentum) = (world.energy(), world.momentum());
        State {
            kinetic_energy_j: kinetic,
            potential_energy_j: potential,
            linear_momentum_n_s: momentum.linear.into(),
            angular_momentum_n_m_s: momentum.angular.into(),
        }
    }
}

impl Worst {
    /// Formats the place as a line of text.
    fn line(&self) -> String {
        let objects: Vec<String> = self.objects.iter().map(|name| format!("'{name}'")).collect();
        format!(
            "the largest residual is at {} at {:.3} s, in an island of {} objects and {} rows; {:.1e} m/s counts as converged",
            objects.join(" and "),
            self.time_s,
            self.island_objects,
            self.island_rows,
            self.tolerance_m_per_s
        )
    }
}

impl Summary {
    /// Formats the summary as a few lines of text.
    pub fn lines(&self) -> String {
        let mut text = format!(
            "{}: {:.3} s in {} frames by {} and {}; {:.1} times real time; a frame at most {:.2} ms (99 %), {:.2} ms (all)\n",
            self.scene,
            self.simulated_s,
            self.steps,
            self.stepper,
            self.solver,
            self.real_time_factor,
            self.frame_p99_ms,
            self.frame_max_ms
        );
        text += &format!(
            "contacts {:.1} a frame (at most {}); residual at most {:.1e} m/s ({} solves unconverged, {} rays); penetration at most {:.2e} m\n",
            self.contacts_mean,
            self.contacts_max,
            self.solver_residual_max_m_per_s,
            self.unconverged_solves,
            self.rays,
            self.max_penetration_m
        );
        if let Some(worst) = self.worst_solve.as_ref().filter(|_| self.unconverged_solves > 0) {
            text += &format!("{}\n", worst.line());
        }
        if let Some(name) = &self.out_of_reach {
            text += &format!("'{name}' is out of reach: open by {:.3} m at most\n", self.out_of_reach_max_m);
        }
        if self.tries_max > 0 {
            text += &format!(
                "tries {:.1} a frame (at most {}); {} floor hits\n",
                self.tries_mean, self.tries_max, self.floor_hits
            );
        }
        let total = |s: &State| without_negative_zero(s.kinetic_energy_j + s.potential_energy_j);
        text + &format!("energy {:.6} J at the start, {:.6} J at the end\n", total(&self.start), total(&self.end))
    }
}

/// The number, or 0 if six decimals would show it as `-0.000000`.
fn without_negative_zero(x: f64) -> f64 {
    if x.abs() < 0.5e-6 { 0.0 } else { x }
}

fn bodies(world: &World) -> Vec<Body> {
    let body = |&id| {
        let (name, pose) = (world.name(id)?, world.pose(id, 0)?);
        Some(Body {
            name: name.to_string(),
            position_m: pose.translation.vector.into(),
            orientation_xyzw: pose.rotation.coords.into(),
            asleep: world.asleep(id),
        })
    };
    world.ids().iter().filter_map(body).collect()
}
