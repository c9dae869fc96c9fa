//! Time of impact: when and how parts that are apart meet within a step, by conservative
//! advancement along free motion.
//!
//! A contact that is predicted at the start of a step has the normal of that start. It would stop a
//! ball that flies past another, and deflect one that strikes off center along the wrong line. Two
//! meshes of many vertices cannot be queried with the margin that a fast step needs. In both cases
//! the pair is advanced to the time at which its surfaces are near:
//!
//! ```text
//! t ← 0;   repeat   t += Δt,   then the contacts at the poses after free motion of t
//!
//! convex shapes    Δt = root of  g + v_n·τ + ½·a_n·τ² = 0      along the normal of the nearest contact
//! any shapes       Δt = g / V
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `g` | gap of the nearest contact, less half of the distance that counts as near; if no contact is within the margin of the query, that margin |
//! | `v_n`, `a_n` | relative velocity and acceleration along its normal |
//! | `V` | bound on the speed at which any gap of the pair can close |
//!
//! The gap between convex shapes along the present normal closes no later than the shapes meet, so
//! no advance overshoots. Another part of a mesh may come first, so meshes advance by the bound.

use super::coplanar::{FacePlane, HALF_SPACE};
use super::detect::{ContactConstraint, PartTable};
use super::own_tests::OwnTests;
use crate::object::FilteredPart;
use crate::object::part_state::PartState;
use crate::rigid::rotation::turn;
use crate::settings::Settings;
use crate::threads::Threads;
use nalgebra::Translation3;
use std::sync::Arc;
use tumble_collide::{Contact, ContactMode, NormalFrom, Pose, Shape, Vec3};

/// A relative displacement in the step below this fraction of the smaller bounding radius needs no
/// search: the normal of the start is accurate enough.
const SHORT_MOTION: f64 = 0.1;
/// Gap at which a part has met an edge, in gaps that count as near elsewhere.
const CLOSE: f64 = 1e-3;
/// Maximum number of queries between the impact and the end of the step.
const MAX_SAMPLES: f64 = 32.0;
/// Minimum number of contacts of a piece on one thread.
const CONTACTS: usize = 64;
/// Maximum number of advances of convex shapes; the state after them is near enough.
const MAX_ADVANCES: u32 = 12;

/// Returns the first time at which `gap + rate·t + ½·acceleration·t²` reaches zero while it
/// decreases; 0 if the gap is closed and decreases, `None` if it stays open or opens.
///
/// The form of the root does not cancel. Any units that agree are allowed.
pub(crate) fn time_to_close(gap: f64, rate: f64, acceleration: f64) -> Option<f64> {
    if gap <= 0.0 {
        return (rate < 0.0).then_some(0.0);
    }
    let discriminant = rate * rate - 2.0 * acceleration * gap;
    let time = 2.0 * gap / (-rate + discriminant.max(0.0).sqrt());
    (discriminant >= 0.0 && time > 0.0 && time.is_finite()).then_some(time)
}

/// Returns a pose after `t` seconds of free motion.
pub(crate) fn pose_after_free_motion(part_state: &PartState, t: f64) -> Pose {
    let position = part_state.position() + t * part_state.velocity + 0.5 * t * t * part_state.acceleration;
    Pose::from_parts(Translation3::from(position), turn(&part_state.pose.rotation, &part_state.angular_velocity, t))
}

/// Two parts in free motion, A first; the states are those of the start of the step.
#[derive(Clone, Copy)]
pub(crate) struct MovingPair<'a> {
    pub mode: ContactMode,
    pub shapes: [&'a Shape; 2],
    pub tests: OwnTests<'a>,
    /// The parts, if shapes of them have filters of their own.
    pub filtered: Option<[FilteredPart<'a>; 2]>,
    pub part_states: [&'a PartState; 2],
    /// The side that is a plane, and its pose in the frame of the part that carries it.
    pub plane: Option<(usize, Pose)>,
    /// Features of contacts that are not found.
    pub skipped: &'a [u64],
}

/// Distance between two parts at some time of a search.
#[derive(Clone, Copy)]
pub(crate) enum Approach {
    /// The nearest contact of convex shapes.
    Convex(Contact),
    /// Any shapes: a gap (m) that closes no faster than `speed` (m/s).
    Bounded { gap: f64, speed: f64 },
}

/// Limits of a search.
#[derive(Clone, Copy)]
pub(crate) struct Search {
    /// Time at which it ends, s.
    pub horizon: f64,
    /// Margin of its queries, m.
    pub margin: f64,
    /// Gap at which the parts have met, m.
    pub near: f64,
    /// Number of advances after which parts with a contact within the margin have met.
    pub max_advances: u32,
}

impl MovingPair<'_> {
    /// Finds the contacts after `t` seconds of free motion, ordered by feature.
    pub fn contacts_after(&self, t: f64, margin: f64, found: &mut Vec<Contact>) {
        self.contacts_at(&self.part_states.map(|part_state| pose_after_free_motion(part_state, t)), margin, found);
    }

    /// Finds the contacts at two poses of the parts, ordered by feature.
    pub fn contacts_at(&self, poses: &[Pose; 2], margin: f64, found: &mut Vec<Contact>) {
        found.clear();
        let mut poses = *poses;
        if let Some((side, pose)) = &self.plane {
            poses[*side] *= pose;
        }
        match self.filtered {
            None => self.tests.contacts(self.mode, self.shapes, poses.each_ref(), margin, found),
            Some([a, b]) => {
                let pairs = a.contact_pairs(&b);
                for [a, b] in &pairs {
                    self.tests.contacts(self.mode, [a, b], poses.each_ref(), margin, found);
                }
                if pairs.len() > 1 {
                    a.drop_buried(&b, &poses[0], found);
                }
            }
        }
        found.retain(|contact| !self.skipped.contains(&contact.feature));
        found.sort_by_key(|contact| contact.feature);
    }

    /// Returns the time from `start` on at which the parts meet, s, and the contact there; `None` if they
    /// do not meet within the horizon. `found` receives all contacts of that time.
    pub fn time_of_impact(
        &self,
        mut approach: Approach,
        start: f64,
        search: &Search,
        found: &mut Vec<Contact>,
    ) -> Option<(f64, Contact)> {
        let mut time = start;
        for advances in 1.. {
            time += self.advance(&approach, time, 0.5 * search.near)?;
            if time.is_nan() || time > search.horizon {
                break;
            }
            self.contacts_after(time, search.margin, found);
            let least = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).copied();
            let nearest = match (&mut approach, least) {
                (Approach::Convex(known), least) => {
                    *known = *found.iter().find(|c| c.feature == known.feature).or(least.as_ref())?;
                    *known
                }
                (Approach::Bounded { gap, .. }, Some(least)) => {
                    *gap = least.gap.min(search.margin);
                    least
                }
                (Approach::Bounded { gap, .. }, None) => {
                    *gap = search.margin;
                    continue;
                }
            };
            if nearest.gap <= search.near || advances >= search.max_advances {
                return Some((time, nearest));
            }
        }
        None
    }

    /// Returns a time span after `time` in which the parts cannot meet, s; `None` if they never do.
    /// Convex shapes aim at a gap of `aim`, so that the last advance does not end just short of
    /// "near".
    fn advance(&self, approach: &Approach, time: f64, aim: f64) -> Option<f64> {
        match approach {
            Approach::Convex(contact) => self.time_to_close(contact, contact.gap - aim, time),
            Approach::Bounded { gap, speed } => Some(gap / speed),
        }
    }

    /// Returns the time from `t` until `gap` closes along the contact's normal in free motion, s.
    fn time_to_close(&self, contact: &Contact, gap: f64, t: f64) -> Option<f64> {
        let [a, b] = self.part_states;
        let spin = |s: &PartState| s.velocity_at(&contact.point) - s.velocity;
        let velocity = a.velocity - b.velocity + t * (a.acceleration - b.acceleration) + spin(a) - spin(b);
        time_to_close(gap, contact.normal.dot(&velocity), contact.normal.dot(&(a.acceleration - b.acceleration)))
    }

    /// Returns the contact at the end of the step if the parts, which have met at `time`, move on
    /// to there without overlap: a ball that rolls over the seam of two boxes does not strike the
    /// edge that it meets. `None` if they overlap on the way.
    fn contact_after_glance(
        &self,
        time: f64,
        samples: f64,
        search: &Search,
        found: &mut Vec<Contact>,
    ) -> Option<Contact> {
        let mut end = None;
        for sample in 1..=samples as u32 {
            self.contacts_after(time + (search.horizon - time) * sample as f64 / samples, search.near, found);
            end = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).copied();
            if end.is_none_or(|contact| contact.gap < -search.near) {
                return None;
            }
        }
        end
    }

    /// Finds the contact with which an open contact of convex shapes closes within `horizon`, and
    /// its time, s; `None` if it does not close. A glancing impact is checked at `samples`
    /// times.
    fn follow(
        &self,
        contact: Contact,
        (horizon, near, samples): (f64, f64, f64),
        found: &mut Vec<Contact>,
    ) -> Option<(f64, Contact)> {
        let search = Search { horizon, margin: contact.gap + near, near, max_advances: MAX_ADVANCES };
        let (time, met) = if contact.gap <= near {
            (0.0, contact)
        } else {
            self.time_of_impact(Approach::Convex(contact), 0.0, &search, found)?
        };
        let rounded = is_at_edge(&met) || matches!(met.normal_from, NormalFrom::CorePoints);
        let end = if rounded { self.contact_after_glance(time, samples, &search, found) } else { None };
        if end.is_none() && is_at_edge(&met) {
            // a face beside the edge may come first
            let close = Search { near: CLOSE * near, ..search };
            return Some(self.time_of_impact(Approach::Convex(met), time, &close, found).unwrap_or((time, met)));
        }
        Some(end.map_or((time, met), |end| (horizon, end)))
    }
}

fn is_at_edge(contact: &Contact) -> bool {
    matches!(contact.normal_from, NormalFrom::LineOfA(_) | NormalFrom::LineOfB(_))
}

/// Returns two parts, one of them as the `plane` that it forms with others if there is one; `None` if one has
/// no shape.
pub(crate) fn moving_pair<'a>(
    table: PartTable<'a>,
    [a, b]: [u32; 2],
    plane: Option<&'a FacePlane>,
) -> Option<MovingPair<'a>> {
    let sides = [table.part(a)?, table.part(b)?];
    let mut states = [a, b].map(|row| &table.part_states[row as usize]);
    let mut shapes = sides.map(|side| side.shape);
    if let Some(plane) = plane {
        let side = plane.side();
        (shapes[side], states[side]) = (&HALF_SPACE, &table.part_states[plane.carrier as usize]);
    }
    let [mode_a, mode_b] = sides.map(|side| side.body.contact_mode(side.part));
    Some(MovingPair {
        mode: mode_a.of_pair(mode_b),
        shapes,
        tests: OwnTests::of([a, b].map(|row| {
            let (entry, part) = table.entry(row);
            (entry.object, part)
        })),
        // the shapes of a plane all meet the other part
        filtered: FilteredPart::pair(sides).filter(|_| plane.is_none()),
        part_states: states,
        plane: plane.map(|plane| (plane.side(), plane.pose)),
        skipped: &[],
    })
}

/// Returns the pair of a contact, and the number of samples of its motion in `h` seconds, if it is fast.
fn fast_pair<'a>(table: PartTable<'a>, h: f64, contact: &'a ContactConstraint) -> Option<(MovingPair<'a>, f64)> {
    let sides = [contact.a, contact.b];
    let states = sides.map(|index| &table.part_states[index as usize]);
    let motion = h * (states[0].velocity - states[1].velocity).norm();
    let pair = moving_pair(table, sides, contact.plane.as_deref())?;
    let short = SHORT_MOTION * pair.size();
    // contacts of a mesh begin and end with its features; a surface of an own test need not be convex
    let timed = motion >= short && pair.is_convex() && !pair.tests.any();
    timed.then_some((pair, (motion / short).min(MAX_SAMPLES).ceil()))
}

/// Replaces the contacts of fast convex parts that close within `h` by those at the time at which
/// the parts meet: the first contact, and the others of that place that may follow it in the rest
/// of the step. Removes contacts that do not close on the way. `predicted` is working memory.
pub(crate) fn time_contacts(
    table: PartTable,
    (settings, threads): (&Settings, &Threads),
    h: f64,
    contact_constraints: &mut Vec<ContactConstraint>,
    predicted: &mut Vec<ContactConstraint>,
) {
    let is_slow = |contact: &ContactConstraint| fast_pair(table, h, contact).is_none();
    let slow = contact_constraints.chunk_by(same_surfaces).take_while(|contacts| is_slow(&contacts[0]));
    let slow: usize = slow.map(<[ContactConstraint]>::len).sum();
    predicted.clear();
    if slow == contact_constraints.len() {
        return;
    }
    predicted.extend(contact_constraints.drain(slow..));
    let pieces = pieces_of_pairs(threads, predicted);
    let mut pieces: Vec<(&[ContactConstraint], Vec<ContactConstraint>)> =
        pieces.into_iter().map(|piece| (piece, Vec::new())).collect();
    // the first piece follows the contacts that stay
    std::mem::swap(contact_constraints, &mut pieces[0].1);
    threads.each(pieces.iter_mut(), |(piece, out)| {
        let mut found = Vec::new();
        for contacts in piece.chunk_by(same_surfaces) {
            match fast_pair(table, h, &contacts[0]) {
                Some((pair, samples)) => {
                    pair.time_contacts(contacts, (h, settings.drift_tolerance, samples), &mut found, out);
                }
                None => out.extend_from_slice(contacts),
            }
        }
    });
    std::mem::swap(contact_constraints, &mut pieces[0].1);
    pieces.into_iter().for_each(|(_, mut timed)| contact_constraints.append(&mut timed));
}

/// Returns whether two contacts are of the same parts, or of a part and the same plane.
fn same_surfaces(x: &ContactConstraint, y: &ContactConstraint) -> bool {
    match (&x.plane, &y.plane) {
        (None, None) => x.key.pair == y.key.pair,
        (Some(x), Some(y)) => Arc::ptr_eq(x, y),
        _ => false,
    }
}

/// Returns pieces of the contacts; no pair is divided.
fn pieces_of_pairs<'a>(threads: &Threads, contacts: &'a [ContactConstraint]) -> Vec<&'a [ContactConstraint]> {
    let (mut pieces, mut start) = (Vec::new(), 0);
    for piece in threads.pieces(contacts.len(), CONTACTS) {
        let mut end = piece.end.max(start);
        while end > 0 && end < contacts.len() && same_surfaces(&contacts[end], &contacts[end - 1]) {
            end += 1;
        }
        pieces.push(&contacts[start..end]);
        start = end;
    }
    pieces
}

impl MovingPair<'_> {
    /// Writes the contacts of the pair to `out`, for those that are predicted at the start of a step. The
    /// open contacts of a compound are followed beside those that touch: a ball that rolls over one part
    /// towards the next meets the face of that part, and not the edge between both.
    fn time_contacts(
        &self,
        predicted: &[ContactConstraint],
        limits: (f64, f64, f64),
        found: &mut Vec<Contact>,
        out: &mut Vec<ContactConstraint>,
    ) {
        let begin = out.len();
        let compound = self.shapes.iter().any(|shape| matches!(shape, Shape::Compound(_)));
        let near = |c: &Contact| if is_at_edge(c) { CLOSE * limits.1 } else { limits.1 };
        let (touching, open): (Vec<_>, Vec<_>) =
            predicted.iter().partition(|c| compound && c.contact.gap <= near(&c.contact));
        let skipped: Vec<u64> = touching.iter().map(|c| c.key.feature).collect();
        MovingPair { skipped: &skipped, ..*self }.follow_open(&open, limits, found, out);
        out.extend(touching.into_iter().cloned());
        out[begin..].sort_by_key(|constraint| constraint.key);
    }

    /// Appends the contacts of the pair, for those that are predicted and followed.
    fn follow_open(
        &self,
        predicted: &[&ContactConstraint],
        limits: (f64, f64, f64),
        found: &mut Vec<Contact>,
        out: &mut Vec<ContactConstraint>,
    ) {
        let horizon = limits.0;
        let closes =
            |c: &ContactConstraint| self.time_to_close(&c.contact, c.contact.gap, 0.0).filter(|t| *t <= horizon);
        let mut order: Vec<(f64, &ContactConstraint)> =
            predicted.iter().filter_map(|c| Some((closes(c)?, *c))).collect();
        order.sort_by(|(s, _), (t, _)| s.total_cmp(t));
        let met = order.iter().find_map(|(_, c)| self.follow(c.contact, limits, found));
        match met {
            Some((time, first)) if time > 0.0 => {
                self.contacts_after(time, self.reach(&first.point, (horizon - time).max(0.5 * horizon)), found);
                if !found.iter().any(|contact| contact.feature == first.feature) {
                    found.push(first);
                }
                let least = predicted.iter().map(|c| c.contact.gap).fold(f64::INFINITY, f64::min);
                out.extend(found.iter().map(|contact| {
                    let known = predicted.iter().find(|c| c.key.feature == contact.feature);
                    let mut constraint = (*known.unwrap_or(&predicted[0])).clone();
                    constraint.find_again(contact, self.part_states, time, known.is_some());
                    // contacts that were not predicted are further away
                    let nearer = (least - constraint.contact.gap).max(0.0);
                    constraint.contact.gap += nearer;
                    constraint.moved.turned -= nearer;
                    constraint
                }));
            }
            Some(_) => out.extend(predicted.iter().copied().cloned()),
            None => out.extend(predicted.iter().filter(|c| closes(c).is_none()).copied().cloned()),
        }
    }

    /// Returns a bound on the distance that the parts close in `t` seconds at their present speeds
    /// within the size of the smaller one from a point, m.
    pub fn reach(&self, point: &Vec3, t: f64) -> f64 {
        let [a, b] = self.part_states;
        let spin = a.angular_velocity.norm() + b.angular_velocity.norm();
        t * ((a.velocity_at(point) - b.velocity_at(point)).norm() + spin * 2.0 * self.size())
    }

    /// Returns whether the parts collide as convex shapes, or as unions of convex shapes.
    fn is_convex(&self) -> bool {
        let exact = self.mode == ContactMode::Surface || !self.shapes.iter().any(|shape| shape.has_tree());
        exact && self.shapes.iter().all(|shape| shape.has_convex_parts())
    }

    /// Returns the smaller bounding radius, m.
    fn size(&self) -> f64 {
        let [a, b] = self.shapes.map(Shape::bounding_radius);
        a.min(b)
    }
}

impl ContactConstraint {
    /// Replaces the contact by that of the time `t` of impact, s, as seen from the start of the
    /// step: lever arms and normal of the impact, and the gap that the velocities of its points close
    /// until then.
    pub fn move_to_impact(&mut self, contact: &Contact, [a, b]: [&PartState; 2], t: f64) {
        let moved = |s: &PartState| pose_after_free_motion(s, t).translation.vector - s.position();
        let ways: [Vec3; 2] = [moved(a), moved(b)];
        let turned = |s: &PartState, way: Vec3| t * s.angular_velocity.cross(&(contact.point - s.position() - way));
        let closed = contact.normal.dot(&(turned(a, ways[0]) - turned(b, ways[1])));
        self.place_at(&Contact { gap: contact.gap - closed, ..*contact }, ways, t);
    }

    /// Replaces point and normal by those of a contact of the time `t`, s, in free motion. The gap stays
    /// that of the start of the step if it is of the same feature.
    pub fn find_again(&mut self, contact: &Contact, parts: [&PartState; 2], t: f64, same: bool) {
        let gap = self.contact.gap;
        self.move_to_impact(contact, parts, t);
        self.moved.turned = 0.0;
        if same {
            self.moved.turned = self.contact.gap - gap;
            self.contact.gap = gap;
        }
    }

    /// Replaces the contact by one of the time `t`, s, at which the parts have moved by `move_a` and
    /// `move_b`, m, and not turned.
    pub fn place_at(&mut self, contact: &Contact, [move_a, move_b]: [Vec3; 2], t: f64) {
        let closed = contact.normal.dot(&(move_a - move_b));
        let mut shapes = contact.shapes;
        if let Some(plane) = &self.plane {
            shapes[plane.side()] = self.contact.shapes[plane.side()];
        }
        self.contact = Contact { point: contact.point - move_a, gap: contact.gap - closed, shapes, ..*contact };
        self.key.feature = contact.feature;
        self.offset = move_a - move_b;
        self.found_at = t;
        self.frame = self.frame_at(contact.point, contact.normal);
    }
}

#[cfg(test)]
mod tests {
    use super::time_to_close;

    /// `g + v·t + ½·a·t²` with roots placed by hand: `(t − 2)(t − 3) = 6 − 5t + t²`.
    #[test]
    fn a_gap_closes_at_the_first_root_of_its_parabola() {
        assert_eq!(time_to_close(6.0, -5.0, 2.0), Some(2.0));
        assert_eq!(time_to_close(6.0, -3.0, 0.0), Some(2.0), "without acceleration");
        assert_eq!(time_to_close(4.0, 0.0, -2.0), Some(2.0), "from rest");
        assert_eq!(time_to_close(3.0, 2.0, -2.0), Some(3.0), "opens first");
        assert_eq!(time_to_close(1.0, -1.0, 2.0), None, "turns back before");
        assert_eq!(time_to_close(1.0, 1.0, 0.0), None, "opens");
        assert_eq!(time_to_close(1.0, 0.0, 0.0), None, "rests");
        assert_eq!(time_to_close(-1.0, -1.0, 0.0), Some(0.0), "overlaps and approaches");
        assert_eq!(time_to_close(0.0, 1.0, -9.0), None, "touches and separates");
        assert_eq!(time_to_close(f64::NAN, -1.0, 0.0), None);
        // a slow closing beside a large rate: the textbook form would cancel to 0
        assert!((time_to_close(1e-12, -1.0, 1e-3).unwrap() - 1e-12).abs() < 1e-26);
    }
}
