//! Joints that cannot be closed, such as those of a straight chain whose end is pulled further: the
//! fallback of the correction.
//!
//! In the direction that is out of reach the response of the rows, an eigenvalue `σ` of `K`, goes
//! to 0 while the demanded speed does not, so `λ = −c/σ` makes joint speeds without bound. If the
//! correction finds no closed configuration, the rows therefore become soft,
//!
//! ```text
//! (K + R)·λ = −c          R = ρ·k            largest gain of a row:  max_σ √(σk)/(σ + ρk) = 1/(2√ρ)
//! ```
//!
//! and the velocity of the joined objects is their displacement over the step divided by its
//! length:
//!
//! ```text
//! v₁ = ½(v₀ + v*) + (x₁ ⊖ x*)/h
//! ```
//!
//! So the chain stays at the nearest configuration, straight and pointing at its goal, and moves as
//! fast as that configuration does. Whether joints are unreachable is tested at the middle of the
//! step, and at its end if their rows are already weak.
//!
//! | symbol | meaning |
//! |---|---|
//! | `x₀`, `v₀` | state and velocity at the start of the step |
//! | `x*`, `v*` | the same after free motion and impulses of the soft rows |
//! | `x₁` | the configuration nearest to closed that the correction finds from `x*` (Levenberg and Marquardt) |
//! | `k` | the largest response `Y·Y` among the rows of one constraint and unit: that of a single row may be the one that vanishes |
//! | `ρ` | [`GIVING`] for velocities |
//! | `⊖` | displacement, generalized velocity times seconds |

use super::Workspace;
use super::correction::is_joint;
use crate::constraint::builder::{RowKind, constraints};
use crate::report::UnreachableJoint;
use crate::solver::smallest_pivot;
use crate::world::{Coordinates, Core};
use std::ops::Range;

/// Compliance of the velocity rows of unreachable joints, as a fraction of their response: they
/// move by at most half the demanded speed, and the correction moves them to their place. Stiffer
/// rows would make a straight chain buckle on the way back, before its end is in reach.
pub(super) const GIVING: f64 = 1.0;

/// A group whose rows respond in some direction by less than this fraction may reach its full
/// stretch before the step ends.
const WEAK: f64 = 3e-2;

/// Returns the joint rows of one constraint and unit, as ranges of targets.
fn alike(work: &Workspace) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    let kind = |i: usize| (work.kinds[i], is_joint(&work.targets[i]));
    for of_one in work.first.windows(2) {
        for i in of_one[0]..of_one[1] {
            match out.last_mut() {
                Some(last)
                    if last.start >= of_one[0]
                        && kind(last.start) == kind(i)
                        && kind(i) != (RowKind::Coordinate, true) =>
                {
                    last.end = i + 1
                }
                _ => out.push(i..i + 1),
            }
        }
    }
    out
}

/// Gives the rows of `targets` a compliance: `share` of the largest response among rows of the same
/// constraint and unit.
pub(super) fn soften(work: &mut Workspace, targets: &[u32], share: f64) {
    let contact_constraints = work.contact_constraints.len();
    if !targets.is_empty() {
        let references = references(work);
        targets
            .iter()
            .map(|&i| i as usize)
            .for_each(|i| work.rows.blocks[contact_constraints + i].compliance = share * references[i]);
    }
}

/// Returns, for each target, the largest response among rows of the same constraint and unit.
fn references(work: &Workspace) -> Vec<f64> {
    let mut out = vec![0.0; work.targets.len()];
    for range in alike(work) {
        let own = |i: usize| work.rows.own(&work.rows.blocks[work.contact_constraints.len() + i], 0, 0);
        let most = range.clone().map(own).fold(0.0, f64::max);
        out[range].fill(most);
    }
    out
}

/// Returns whether the joint rows of `targets`, in a workspace without contacts, have a weak
/// response in some direction: a pivot of `K` is small against the references of the rows.
pub(super) fn weak(work: &Workspace, targets: &[u32]) -> bool {
    let (references, e) = (references(work), targets.len());
    let scale = |i: usize| 1.0 / references[targets[i] as usize].max(f64::MIN_POSITIVE).sqrt();
    let mut k = work.rows.dense(targets);
    (0..e * e).for_each(|at| k[at] *= scale(at / e) * scale(at % e));
    smallest_pivot(&k, e).is_some_and(|pivot| pivot < WEAK)
}

/// Returns the errors of constraint rows after a reduction by at most `reach`, m or rad: of all
/// rows of a joint along a straight line, of any other row by itself.
pub(super) fn left(work: &Workspace, errors: impl Fn(usize) -> f64, reach: f64) -> Vec<f64> {
    let mut out = vec![0.0; work.targets.len()];
    for range in alike(work) {
        let joint = is_joint(&work.targets[range.start]);
        let size = range.clone().map(|i| errors(i).powi(2)).sum::<f64>().sqrt();
        for i in range {
            let (e, size) = (errors(i), if joint { size } else { errors(i).abs() });
            out[i] = if size <= reach { 0.0 } else { e * (1.0 - reach / size) };
        }
    }
    out
}

/// Sets each listed object's velocity to its net displacement over the step divided by `h`: the
/// mean of its velocities in the states `start` and `arrived`, plus the correction `moved`
/// (generalized velocity times seconds). `ranges` are those of its state and its velocities.
pub(super) fn go_as_moved(
    Coordinates { objects, x, .. }: Coordinates,
    ranges: &[(Range<usize>, Range<usize>)],
    [start, arrived]: [&[f64]; 2],
    moved: &[f64],
    h: f64,
) {
    for entry in objects.iter().filter(|e| e.moves() && ranges.iter().any(|(range, _)| *range == e.state_range.x)) {
        let Some(body) = entry.object.integratable() else { continue };
        let (mut v, mut first) = (vec![0.0; entry.state_range.v.len()], vec![0.0; entry.state_range.v.len()]);
        body.velocity(&start[entry.state_range.x.clone()], &mut first);
        body.velocity(&arrived[entry.state_range.x.clone()], &mut v);
        v.iter_mut()
            .zip(&first)
            .zip(&moved[entry.state_range.v.clone()])
            .for_each(|((v, first), moved)| *v = 0.5 * (*v + first) + moved / h);
        body.write_velocity(&mut x[entry.state_range.x.clone()], &v);
    }
}

/// Reports the joint among `targets` that is furthest open, by the rows of `probe`.
pub(super) fn report(core: &mut Core, probe: &Workspace, targets: &[u32]) {
    let ids: Vec<_> = constraints(core.objects()).map(|(id, ..)| id).collect();
    for range in alike(probe).into_iter().filter(|r| targets.binary_search(&(r.start as u32)).is_ok()) {
        let Some(&loop_joint) = ids.get(probe.first.partition_point(|&f| f <= range.start) - 1) else { continue };
        let size = range.clone().map(|i| probe.targets[i].error.powi(2)).sum::<f64>().sqrt();
        let by = if probe.kinds[range.start] == RowKind::Rotation { [0.0, size] } else { [size, 0.0] };
        let worst = core.report.unreachable_joint.map_or([0.0; 2], |o| [o.distance, o.angle]);
        if by[0] > worst[0] || (worst[0] == 0.0 && by[1] > worst[1]) {
            core.report.unreachable_joint = Some(UnreachableJoint { loop_joint, distance: by[0], angle: by[1] });
        }
    }
}
