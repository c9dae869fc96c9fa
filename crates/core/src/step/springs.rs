//! Springs of joints that are stiff for the step.
//!
//! A spring has the implicit midpoint rule, which keeps its energy at any stiffness. Two things break that, and are mended here:
//!
//! ```text
//! rule        λ = −h·k·(q₀ + α·(q₁ − q₀)),      q₁ = q₀ + h·((1 − α)·w₀ + α·w₁)          α = ½: midpoint,  1: backward Euler
//! row         w₁ + R·λ = w*,    R = 1/(k·α²·h²),    w* = −(q₀ + α·(1 − α)·h·w₀)/(α²·h)
//! α           ½·(1 + min(1, ¼·d)·x/(1 + x)),    x = ¼·h²·k·K,    d = h·c·K
//! correction  g = q(x₁) − q₁,    K·μ + R·Σμ = −g
//! ```
//!
//! *The extension is no sum of rates where bodies turn.* That of the end, `q(x₁)`, is off by the order `h³`, and the stiffer the
//! spring, the more energy that is. So the correction of the step moves it to that of the rule, but it yields by
//! `R·μ`: it hardly moves where the spring is soft, and in the limit of a stiff one as for a joint.
//!
//! *Damping acts at the end of a step.* On velocities that a stiff spring reverses in each step it does work
//! before it takes some: the energy may grow by the factor `1 + ½d`, and a stiff spring hardly decays. So springs that are damped become
//! implicit, with an error of the order `h⁴`. For `x` far above 1 the amplitude of a spring falls by `(1 − α)/α` in a step, which is
//! `e^(−½d)` to first order: it decays as in reality, however stiff it is.
//!
//! | symbol | meaning |
//! |---|---|
//! | `q₀`, `q₁` | extension at the start, and at the end by the rule, m or rad |
//! | `w₀`, `w₁` | its rate at the start and at the end |
//! | `k`, `c` | stiffness, damping |
//! | `λ`, `K`, `R` | impulse, response of the row, its compliance |

use super::Workspace;
use crate::constraint::rows::{Block, RowSet};
use crate::object::{Level, RowTarget, SpringRow};

/// A spring, damper or drive is stiff if it changes its own velocity by more than this fraction of it in the step.
const STIFF: f64 = 0.1;

/// Returns whether a row is a spring, damper or drive of finite gain that is stiff for the step.
pub(super) fn is_stiff(work: &Workspace, block: &Block, t: &RowTarget) -> bool {
    t.set == RowSet::Equality && t.compliance > 0.0 && work.rows.own(block, 0, 0) > STIFF * t.compliance
}

/// Returns whether any spring is stiff.
pub(super) fn any_stiff(work: &Workspace) -> bool {
    let blocks = &work.rows.blocks[work.contact_constraints.len()..];
    work.targets.iter().zip(blocks).any(|(t, block)| t.spring.is_some() && is_stiff(work, block, t))
}

/// Makes stiff springs that are damped implicit. Rows have those of the midpoint rule, and springs the extensions of the start.
pub(super) fn make_implicit(work: &mut Workspace, level: Level) {
    let h = level.h();
    if level.soft_step() != Some(h) {
        return; // damping acts in the middle of the step
    }
    let contacts = work.contact_constraints.len();
    for i in 0..work.targets.len() {
        let (target, block) = (work.targets[i], work.rows.blocks[contacts + i]);
        let Some(SpringRow { extension, stiffness, damping }) = target.spring.filter(|spring| spring.damping > 0.0)
        else {
            continue;
        };
        let own = work.rows.own(&block, 0, 0);
        let (x, d) = (0.25 * h * h * stiffness * own, h * damping * own);
        let share = (0.25 * d).min(1.0) * x / (1.0 + x);
        let (alpha, first) = (0.5 * (1.0 + share), -target.velocity - 4.0 * extension / h);
        let compliance = 1.0 / (stiffness * alpha * alpha * h * h);
        work.rows.blocks[contacts + i].compliance = compliance;
        let velocity = -(extension + alpha * (1.0 - alpha) * h * first) / (alpha * alpha * h);
        work.targets[i] = RowTarget { compliance, velocity, ..target };
    }
}

/// Returns the extensions at the end of the step by the rule, m or rad; 0 for other rows.
pub(super) fn extensions_at_end(work: &Workspace, level: Level) -> Vec<f64> {
    let h = level.h();
    let to_impulse = if level.step().is_some() { 1.0 } else { h };
    let blocks = &work.rows.blocks[work.contact_constraints.len()..];
    let at_end = |(t, block): (&RowTarget, &Block)| {
        let Some(SpringRow { extension, stiffness, .. }) = t.spring else { return 0.0 };
        let alpha = 1.0 / (h * (stiffness * t.compliance).sqrt());
        let acting = -to_impulse * work.lambda[block.row as usize] / (h * stiffness);
        extension + (acting - extension) / alpha
    };
    work.targets.iter().zip(blocks).map(at_end).collect()
}
