//! Joints that are led to where they cannot be: a chain at full stretch whose end is pulled on.
//!
//! The rows of such a joint lose their hold in the direction that is out of reach: what a unit of multiplier does there, an eigenvalue `σ` of `K`, goes to 0 while
//! the speed asked for does not, and `λ = −c/σ` makes joint speeds without bound. So where closing finds no place the rows give way,
//!
//! ```text
//! (K + R)·λ = −c          R = ρ·k            most that a row is amplified:  max_σ √(σk)/(σ + ρk) = 1/(2√ρ)
//! ```
//!
//! and the velocity of what they join is the way that it went: `x*` and `v*` are where free motion and softened rows lead to, `x₁` is the nearest to closed that
//! closing found from there (Levenberg and Marquardt: `R` grows while a round makes things worse),
//!
//! ```text
//! v₁ = ½(v₀ + v*) + (x₁ ⊖ x*)/h
//! ```
//!
//! So what is out of reach hangs where it is nearest, straight and towards what leads it, and goes as fast as that place does. Whether it is out of reach is
//! asked at the middle of the step, and at its end where rows are weak already.
//!
//! | symbol | meaning |
//! |---|---|
//! | `k` | the largest response `Y·Y` among the rows of one constraint that have one unit: one row's own may be what is lost |
//! | `ρ` | [`GIVING`] for velocities |
//! | `⊖` | displacement, generalized velocity times seconds |

use super::Workspace;
use super::joint_correction::is_joint;
use crate::constraint::builder::{RowKind, constraints};
use crate::report::UnreachableJoint;
use crate::solver::smallest_pivot;
use crate::world::{Coordinates, Core};
use std::ops::Range;

/// Compliance of the velocity rows of what is out of reach, as a share of their response: nothing there is asked for more than half the speed that it is led with.
/// Where it goes is left to closing. Held harder, what is led back would make a straight chain buckle before its end is in reach.
pub(super) const GIVING: f64 = 1.0;

/// A piece whose rows respond in some direction by less than this share may be at its full stretch before the step ends.
const WEAK: f64 = 3e-2;

/// Joint rows of one constraint that have one unit, as ranges of targets.
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

/// Gives the rows of the targets named a compliance: `share` of the largest response among those like them.
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

/// The largest response among the rows like each target's.
fn references(work: &Workspace) -> Vec<f64> {
    let mut out = vec![0.0; work.targets.len()];
    for range in alike(work) {
        let own = |i: usize| work.rows.own(&work.rows.blocks[work.contact_constraints.len() + i], 0, 0);
        let most = range.clone().map(own).fold(0.0, f64::max);
        out[range].fill(most);
    }
    out
}

/// Whether the joint rows named, of a workspace without touches, hold weakly in some direction: a pivot of `K` is small against the rows' references.
pub(super) fn weak(work: &Workspace, targets: &[u32]) -> bool {
    let (references, e) = (references(work), targets.len());
    let scale = |i: usize| 1.0 / references[targets[i] as usize].max(f64::MIN_POSITIVE).sqrt();
    let mut k = work.rows.dense(targets);
    (0..e * e).for_each(|at| k[at] *= scale(at / e) * scale(at % e));
    smallest_pivot(&k, e).is_some_and(|pivot| pivot < WEAK)
}

/// What is left of the errors of joint rows when each joint is closed by `reach` at most, straight; of other rows each is by itself.
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

/// Gives the objects with these stretches of the state the velocity that their way in `h` is: the mean of those of the states `start` and `arrived`, and what they
/// were `moved` from there, generalized velocities times seconds.
pub(super) fn go_as_moved(
    Coordinates { objects, x, .. }: Coordinates,
    stretches: &[(Range<usize>, Range<usize>)],
    [start, arrived]: [&[f64]; 2],
    moved: &[f64],
    h: f64,
) {
    for entry in objects.iter().filter(|e| e.moves() && stretches.iter().any(|(range, _)| *range == e.state_range.x)) {
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

/// Files the joint among the targets named that is furthest open, by the rows of `probe`.
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
