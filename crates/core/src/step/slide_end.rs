//! Event location for the ends of slides in `backtracking`: the time at which a contact that slides comes to rest on its
//! surface, where friction falls from its limit to what holds the contact.
//!
//! A solve over `h` brings a contact to rest by a constant friction, which is less than its limit if the slide ends before:
//!
//! ```text
//! v₀ + h·(a + K·f) = 0   ⇒   −f·v̂₀ = (|v₀|/h + a·v̂₀)/K        f·v̂₀ = −s·μ·λₙ        s(h) = α + β/h
//! ```
//!
//! The slide ends at the `h` of `s = 1`. `s` is linear in `1/h`, so a second try is exact while nothing turns. A contact that slides
//! back at the end has `s = −1` whatever `h` is: then half of it is tried. A try that ends before the slide has its deceleration.
//!
//! Contacts with kinematic bodies are left out, because their velocity jumps from frame to frame, and so are frames with a budget.
//!
//! | symbol | meaning |
//! |---|---|
//! | `v₀`, `v̂₀` | sliding velocity at the start, and its direction |
//! | `a`, `K` | acceleration without friction; inverse mass along the surface |
//! | `f`, `μ·λₙ` | friction, and its limit |
//! | `s` | share of the limit that the contacts of a pair need: the power of friction over that of sliding friction |

use super::Workspace;
use crate::constraint::rows::RowSet;
use crate::contact::detect::ContactConstraint;
use crate::world::Core;
use crate::world::view::Mode;
use std::ops::Range;

/// A contact still slides if it keeps more than this fraction of its velocity.
const SLIDING: f64 = 1e-6;
/// Fraction of the contact tolerance by which a frame may misplace a contact whose slide ends in it.
const LOCATED: f64 = 1e-2;
/// Most solves of a frame, or of a piece of one that is divided, that locate ends; later ones end within a sub-step.
const MOST: u32 = 24;

/// The search for the next end of a slide.
#[derive(Default)]
pub(super) struct SlideEnds {
    /// Solves of the frame, or of the piece of it, that were spent on it.
    pub solves: u32,
    tried: Option<Tried>,
}

/// The pair whose slide was to end, the length of a sub-step in which it ends, s, and the share `s`.
#[derive(Clone, Copy)]
struct Tried {
    pair: [u32; 2],
    h: f64,
    share: f64,
}

impl SlideEnds {
    /// Begins the search in a new sub-step.
    pub fn start(&mut self) {
        self.tried = None;
    }

    /// Returns another length for a sub-step of `h` that has been solved: until the first end of a slide in it, if there is one.
    /// `velocity` has the velocities of the rows at its start.
    pub fn before(&mut self, core: &Core, work: &Workspace, velocity: &[f64], h: f64) -> Option<f64> {
        let settings = &core.settings;
        if self.solves >= MOST || settings.solver_settings.budget.is_some() {
            return None;
        }
        let slowest = 2.0 * LOCATED * settings.contact_tolerance / settings.dt;
        let mut first: Option<(f64, Tried)> = None;
        let mut start = 0;
        for run in work.contact_constraints.chunk_by(|a, b| pair(a) == pair(b)) {
            let blocks = start..start + run.len();
            start = blocks.end;
            if pair(&run[0]).into_iter().any(|part| is_kinematic(core, part)) {
                continue;
            }
            let Some(slide) = Slide::of(work, velocity, blocks, h, slowest) else { continue };
            let before = self.tried.filter(|tried| tried.pair == pair(&run[0]));
            let found = if slide.kept <= SLIDING {
                let tried = Tried { pair: pair(&run[0]), h, share: slide.share };
                (slide.speed * (1.0 - slide.share) > slowest).then(|| (tried.end(before), tried))
            } else {
                let tried = before.filter(|_| slide.kept < 1.0 && slide.speed * slide.kept > slowest);
                let end = |tried: Tried| ((h / (1.0 - slide.kept)).min(0.999_999 * tried.h), tried);
                tried.map(end).filter(|(end, _)| *end > h)
            };
            first = [first, found].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        }
        let (end, tried) = first?;
        (self.tried, self.solves) = (Some(tried), self.solves + 1);
        Some(end)
    }
}

impl Tried {
    /// The length at which the share becomes 1: by an earlier try too, or as if nothing else pushed along the surface.
    fn end(&self, before: Option<Tried>) -> f64 {
        let end = match before.filter(|before| before.share.min(self.share) > -0.999) {
            Some(before) => {
                let rate = (self.share - before.share) / (1.0 / self.h - 1.0 / before.h);
                1.0 / (1.0 / self.h + (1.0 - self.share) / rate)
            }
            None => self.h * self.share,
        };
        if end > 0.1 * self.h && end < self.h { end } else { 0.5 * self.h }
    }
}

fn is_kinematic(core: &Core, part: u32) -> bool {
    core.objects().at(core.owners[part as usize].place as usize).status.mode == Mode::Kinematic
}

fn pair(contact: &ContactConstraint) -> [u32; 2] {
    [contact.a, contact.b]
}

/// The contacts of a pair that slide at the start: those that rest at the end if there are any, or all.
#[derive(Clone, Copy, Default)]
struct Slide {
    /// Largest speed at the start, m/s.
    speed: f64,
    /// Fraction of the velocity that is left at the end.
    kept: f64,
    /// `s`
    share: f64,
}

impl Slide {
    /// Returns `None` if no contact at `blocks` slides faster than `slowest`, m/s.
    fn of(work: &Workspace, velocity: &[f64], blocks: Range<usize>, h: f64, slowest: f64) -> Option<Slide> {
        let (mut rest, mut slide) = (Sums::default(), Sums::default());
        for block in &work.rows.blocks[blocks] {
            let (RowSet::Cone { mu }, row) = (block.set, block.row as usize) else { continue };
            let own = |numbers: &[f64]| [numbers[row + 1], numbers[row + 2]];
            let (v, friction, limit) = (own(velocity), own(&work.lambda), mu * work.lambda[row]);
            let speed = dot(v, v).sqrt();
            if speed > slowest && limit > 0.0 {
                let end = [1, 2].map(|k| h * (work.c[row + k] + work.rows.row_velocity(block, k, &work.du)));
                let sums = if dot(end, v) > SLIDING * speed * speed { &mut slide } else { &mut rest };
                sums.add(v, speed, dot(end, v), -dot(friction, v), limit * speed);
            }
        }
        let sums = if rest.speed > 0.0 { rest } else { slide };
        let of = |sums: Sums| Slide { speed: sums.speed, kept: sums.end / sums.start, share: sums.spent / sums.limit };
        (sums.speed > 0.0).then(|| of(sums))
    }
}

/// Sums over contacts.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Largest speed at the start, m/s.
    speed: f64,
    /// `v₀·v₀` and `v₀·v(h)`, m²/s².
    start: f64,
    end: f64,
    /// Power of friction at the start, and that of sliding friction, W.
    spent: f64,
    limit: f64,
}

impl Sums {
    fn add(&mut self, v: [f64; 2], speed: f64, end: f64, spent: f64, limit: f64) {
        self.speed = self.speed.max(speed);
        self.start += dot(v, v);
        self.end += end;
        self.spent += spent;
        self.limit += limit;
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
