//! Adhesion: a force that pulls touching surfaces together, shared by the points of a pair that touch and have it.
//!
//! The force on A is `−F/k·n` at each of `k` touching points. It is a force like any other; the contact
//! then presses with `λ_n ≥ 0` against it, and reports `λ_n − F/k`. A pair comes apart where something
//! pulls harder than `F`.

use super::Workspace;
use crate::contact::detect::ContactConstraint;

/// Writes the pull of each contact (N), for gaps up to `reach`, m, and adds the whitened force times
/// `scale` to `du`. Rows are those of `work`.
pub(super) fn adhere(work: &mut Workspace, reach: f64, scale: f64, du: &mut [f64]) {
    let Workspace { contact_constraints, rows, .. } = work;
    let adheres = |c: &ContactConstraint| c.laws.as_ref().map_or(0.0, |laws| laws.adhesion);
    let mut first = 0;
    for contacts in contact_constraints.chunk_by_mut(|a, b| a.key.pair == b.key.pair) {
        let blocks = &rows.blocks[first..first + contacts.len()];
        first += contacts.len();
        for (k, block) in blocks.iter().enumerate() {
            let force = adheres(&contacts[k]);
            if force == 0.0 {
                continue;
            }
            let touching = contacts.iter().filter(|c| c.contact.gap <= reach && adheres(c) == force).count().max(1);
            let pull = if contacts[k].contact.gap <= reach { force / touching as f64 } else { 0.0 };
            contacts[k].laws.iter_mut().for_each(|laws| laws.pull = pull);
            if pull > 0.0 {
                rows.push_row(block, 0, -scale * pull, du);
            }
        }
    }
}
