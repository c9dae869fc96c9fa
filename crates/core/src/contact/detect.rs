//! Contact detection: broad phase, filters, narrow phase.

use crate::contact::coplanar::FacePlane;
use crate::contact::internal_edges::{InternalEdges, Surroundings};
use crate::contact::laws::ContactLaws;
use crate::contact::motion::Moved;
use crate::contact::own_tests::OwnTests;
use crate::contact::pair::{CachedContacts, KnownContacts, MotionBounds, NarrowPhaseCache, PairQuery, Reach};
use crate::contact::pair_material::PairMaterials;
use crate::contact::surfaces::PairSurfaces;
use crate::contact::time_of_impact::MovingPair;
use crate::object::FilteredPart;
use crate::object::collidable::{Collidable, ContactFrame};
use crate::object::part_state::PartState;
use crate::settings::Settings;
use crate::threads::Threads;
use crate::world::view::{Entry, Mode, ObjectId, Objects};
use std::sync::Arc;
use tumble_collide::{Aabb, BroadPhase, Contact, Vec3};

/// The object of a row of the part table, and the part of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Owner {
    pub id: ObjectId,
    /// Place of the object in the order of adding.
    pub place: u32,
    pub part: u32,
}

/// The part table at one moment.
#[derive(Clone, Copy)]
pub(crate) struct PartTable<'a> {
    pub objects: Objects<'a>,
    pub owners: &'a [Owner],
    pub part_states: &'a [PartState],
    pub pair_materials: &'a PairMaterials,
}

impl<'a> PartTable<'a> {
    /// Returns the object of a row, and the part of it.
    pub fn entry(&self, row: u32) -> (Entry<'a>, usize) {
        let owner = &self.owners[row as usize];
        (self.objects.at(owner.place as usize), owner.part as usize)
    }

    /// Returns the part of a row; `None` without a shape.
    pub fn part(&self, row: u32) -> Option<FilteredPart<'a>> {
        let (entry, part) = self.entry(row);
        let named = FilteredPart::of(entry.object.collidable()?, part)?;
        Some(named.named(self.owners[row as usize].id, self.pair_materials))
    }
}

/// Minimum number of pairs of a piece of the narrow phase, about 10 µs.
const PAIRS: usize = 32;
/// Minimum number of parts of a piece of the bounds, about 10 µs.
const PARTS: usize = 128;

/// Identifies a contact across steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub(crate) struct ContactKey {
    /// Serial and part of either side, A first.
    pub pair: [u32; 4],
    pub feature: u64,
}

/// A contact between two parts, with the constants of the pair.
#[derive(Clone, Debug)]
pub(crate) struct ContactConstraint {
    pub a: u32,
    pub b: u32,
    pub contact: Contact,
    /// From A's contact point to B's, m: not zero if the bodies meet later in the step.
    pub offset: Vec3,
    /// Time after the start of the step at which normal and lever arms were found, s.
    pub found_at: f64,
    /// Time and place of frame and point, if not those at which the contact was found.
    pub moved: Moved,
    pub frame: ContactFrame,
    pub friction: f64,
    pub restitution: f64,
    /// Velocity of A's surface over A, less that of B's, m/s, world axes.
    pub surface_velocity: Vec3,
    /// Laws of the pair beside Coulomb's, if any.
    pub laws: Option<Box<ContactLaws>>,
    /// The plane that takes the place of a part's shape, if it is one tile of many.
    pub plane: Option<Arc<FacePlane>>,
    pub key: ContactKey,
}

/// The detector's working memory.
#[derive(Default)]
pub(crate) struct DetectorBuffers {
    /// Bounds of each part that is collidable.
    part_bounds: Vec<Option<PartBounds>>,
    proxies: Vec<u32>,
    motion_bounds: Vec<MotionBounds>,
    narrow_phase_cache: NarrowPhaseCache,
    /// Boxes of the broad phase: those of the last detection, and of this one. Ascending, like the
    /// part table.
    registered: Vec<BroadPhaseProxy>,
    gathered: Vec<BroadPhaseProxy>,
    /// Place in `proxies` of every handle, and of every part that has a box.
    place: Vec<u32>,
    place_of_part: Vec<u32>,
    /// [`Walk::layout`](crate::world::walk::Walk::layout) that the bounds and boxes are of.
    layout: Option<u64>,
    pairs: Vec<[u32; 2]>,
    /// Results of the pieces of the narrow phase.
    found: Vec<Found>,
    internal_edges: InternalEdges,
}

/// Results of consecutive pairs.
#[derive(Default)]
struct Found {
    contact_constraints: Vec<ContactConstraint>,
    needs_wake: Vec<u32>,
    cached: CachedContacts,
    /// Contacts of the last pair.
    contacts: Vec<Contact>,
}

impl DetectorBuffers {
    /// Begins a frame: it does not depend on contacts that are cached in the one before.
    pub fn forget(&mut self) {
        self.narrow_phase_cache.forget();
    }

    /// Returns whether the last detection found contacts that the start of the next frame can have again.
    pub fn keeps_contacts(&self) -> bool {
        self.narrow_phase_cache.keeps_any()
    }

    /// Computes the bounds of all parts in the next detection: they may be those of another world.
    pub fn forget_parts(&mut self) {
        self.layout = None;
    }
}

/// Bounds of a part within the horizon.
#[derive(Clone, Copy)]
struct PartBounds {
    /// Serial and part.
    key: [u32; 2],
    motion: MotionBounds,
    /// Box around its motion, with the drift tolerance.
    swept: Aabb,
    moving: bool,
}

/// A part that has a box in the broad phase, under a handle.
#[derive(Clone, Copy)]
struct BroadPhaseProxy {
    /// Serial and part.
    key: [u32; 2],
    handle: u32,
}

/// Inputs and working memory of a detection.
pub(crate) struct Detector<'a> {
    pub table: PartTable<'a>,
    pub settings: &'a Settings,
    pub broad: &'a mut dyn BroadPhase,
    pub scratch: &'a mut DetectorBuffers,
    pub threads: &'a Threads,
    /// Serials of sleeping objects that something comes near.
    pub needs_wake: &'a mut Vec<u32>,
}

impl Detector<'_> {
    /// Finds all contacts whose gap is at most the distance that the pair may close within
    /// `reach`, plus twice the drift tolerance; without those at internal edges of flush bodies.
    pub fn detect(&mut self, reach: Reach, out: &mut Vec<ContactConstraint>) {
        out.clear();
        self.gather(reach);
        let mut pairs = std::mem::take(&mut self.scratch.pairs);
        self.broad.pairs(&mut pairs);
        self.order_by_part(&mut pairs);
        let mut found = std::mem::take(&mut self.scratch.found);
        let alone = self.threads.count() == 1 || pairs.len() < 2 * PAIRS;
        let pieces = if alone { Vec::new() } else { self.threads.pieces(pairs.len(), PAIRS) };
        found.resize_with(pieces.len().max(found.len()).max(1), Found::default);
        let narrow = NarrowPhase {
            table: self.table,
            settings: self.settings,
            proxies: &self.scratch.proxies,
            motion_bounds: &self.scratch.motion_bounds,
            near: 2.0 * self.settings.drift_tolerance + reach.distance,
            reach,
        };
        // the first piece writes to the results at once
        std::mem::swap(out, &mut found[0].contact_constraints);
        let last = &self.scratch.narrow_phase_cache;
        let look = |(pairs, found): (&[[u32; 2]], &mut Found)| {
            let mut known = last.from(pairs.first().map_or([0; 2], |pair| narrow.rows(*pair)));
            pairs.iter().for_each(|&pair| narrow.add_pair(pair, &mut known, found));
        };
        if alone {
            look((&pairs[..], &mut found[0]));
        } else {
            let work: Vec<(&[[u32; 2]], &mut Found)> =
                pieces.into_iter().map(|piece| &pairs[piece]).zip(&mut found).collect();
            self.threads.each(work, look);
        }
        std::mem::swap(out, &mut found[0].contact_constraints);
        self.scratch.narrow_phase_cache.replace(found.iter_mut().map(|found| &mut found.cached));
        for found in &mut found {
            out.append(&mut found.contact_constraints);
            self.needs_wake.append(&mut found.needs_wake);
        }
        self.scratch.found = found;
        self.scratch.pairs = pairs;
        let (bounds, near) = (&self.scratch.part_bounds, narrow.near);
        let motion = |part: u32| bounds[part as usize].as_ref().map_or(MotionBounds::default(), |bounds| bounds.motion);
        let around = Surroundings {
            table: self.table,
            drift_tolerance: self.settings.drift_tolerance,
            margin: &|a, b| near + motion(a).between(&motion(b), reach.prediction),
        };
        self.scratch.internal_edges.remove(&around, out);
    }

    /// Puts one box per collidable part, around its motion within the horizon, into the broad
    /// phase.
    fn gather(&mut self, reach: Reach) {
        if !self.bound_parts(reach) {
            return self.move_boxes();
        }
        let s = &mut *self.scratch;
        s.place_of_part.clear();
        s.place_of_part.resize(self.table.owners.len(), 0);
        s.proxies.clear();
        s.motion_bounds.clear();
        s.gathered.clear();
        let mut registered = s.registered.iter().peekable();
        for (index, bounds) in s.part_bounds.iter().enumerate() {
            let Some(PartBounds { key, motion, swept, moving }) = *bounds else { continue };
            while let Some(gone) = registered.next_if(|f| f.key < key) {
                self.broad.remove(gone.handle);
            }
            let handle = match registered.next_if(|f| f.key == key) {
                Some(known) => {
                    self.broad.set(known.handle, &swept, moving);
                    known.handle
                }
                None => self.broad.insert(&swept, moving),
            };
            s.place_of_part[index] = s.proxies.len() as u32;
            s.proxies.push(index as u32);
            s.motion_bounds.push(motion);
            s.gathered.push(BroadPhaseProxy { key, handle });
        }
        registered.for_each(|gone| self.broad.remove(gone.handle));
        std::mem::swap(&mut s.registered, &mut s.gathered);
        let handles = s.registered.iter().map(|f| f.handle as usize + 1).max().unwrap_or(0);
        s.place.resize(handles.max(s.place.len()), 0);
        for (place, registered) in s.registered.iter().enumerate() {
            s.place[registered.handle as usize] = place as u32;
        }
    }

    /// Moves the boxes of the walked parts; no part has gained or lost its box since the last detection.
    fn move_boxes(&mut self) {
        let s = &mut *self.scratch;
        for index in self.table.objects.table.walk.parts.iter().flatten() {
            let Some(PartBounds { motion, swept, moving, .. }) = s.part_bounds[index] else { continue };
            let place = s.place_of_part[index] as usize;
            self.broad.set(s.registered[place].handle, &swept, moving);
            s.motion_bounds[place] = motion;
        }
    }

    /// Computes the bounds of all walked parts: those of settled objects stay. Returns whether any part
    /// has gained or lost its box.
    fn bound_parts(&mut self, reach: Reach) -> bool {
        let Detector { table: PartTable { objects, owners, part_states, .. }, settings, threads, .. } = *self;
        let bounds_of = |index: usize| {
            let Owner { place, part, .. } = owners[index];
            let entry = objects.at(place as usize);
            let collidable =
                Some(entry.object).filter(|_| entry.status.enabled && entry.status.collidable)?.collidable()?;
            let (shape, part_state) = (collidable.shape(part as usize)?, &part_states[index]);
            let tight = shape.aabb(&part_state.pose);
            let around = (tight.max - part_state.position()).sup(&(part_state.position() - tight.min));
            let motion = MotionBounds::new(part_state, shape.bounding_radius(), around, reach.horizon);
            let moving = entry.status.mode != Mode::Static && !entry.asleep;
            // bounds of settled parts stay, so they must not depend on the reach
            let near = settings.drift_tolerance + if moving { reach.distance } else { 0.0 };
            Some(PartBounds { key: [entry.serial, part], motion, swept: motion.swept(&tight, near), moving })
        };
        let bounds = &mut self.scratch.part_bounds;
        let walk = &objects.table.walk;
        let all = self.scratch.layout.replace(walk.layout) != Some(walk.layout) || bounds.len() != owners.len();
        let write = |first: usize, bounds: &mut [Option<PartBounds>]| {
            let write = |(bounds, index): (&mut Option<PartBounds>, usize)| {
                let now = bounds_of(index);
                let changed = now.is_some() != bounds.is_some();
                *bounds = now;
                changed
            };
            bounds.iter_mut().zip(first..).fold(false, |changed, one| write(one) | changed)
        };
        if all {
            bounds.clear();
            bounds.resize(owners.len(), None);
            threads.each_piece(bounds, 1, PARTS, write);
            return true;
        }
        walk.parts.iter().fold(false, |changed, range| {
            let first = range.start;
            if range.len() < 2 * PARTS {
                return write(first, &mut bounds[range]) | changed;
            }
            let pieces = threads.each_piece(&mut bounds[range], 1, PARTS, |from, bounds| write(first + from, bounds));
            pieces.contains(&true) | changed
        })
    }

    /// Converts pairs of handles to pairs of places in `proxies`, ascending, so the result does not
    /// depend on the cache of the broad phase.
    fn order_by_part(&mut self, pairs: &mut [[u32; 2]]) {
        let s = &mut *self.scratch;
        for pair in pairs.iter_mut() {
            let [i, j] = pair.map(|handle| s.place[handle as usize]);
            *pair = [i.min(j), i.max(j)];
        }
        pairs.sort_unstable();
    }
}

/// The narrow phase: constant inputs of all pairs.
struct NarrowPhase<'a> {
    table: PartTable<'a>,
    settings: &'a Settings,
    /// Rows of the part table, and bounds on their motion.
    proxies: &'a [u32],
    motion_bounds: &'a [MotionBounds],
    /// Distance that counts as near, m.
    near: f64,
    reach: Reach<'a>,
}

impl NarrowPhase<'_> {
    /// Returns the rows of the part table of a pair of proxies.
    fn rows(&self, pair: [u32; 2]) -> [u32; 2] {
        pair.map(|i| self.proxies[i as usize])
    }

    /// Adds the contacts of one pair.
    fn add_pair(&self, pair: [u32; 2], known: &mut KnownContacts, results: &mut Found) {
        let ([a, b], [i, j]) = (self.rows(pair), pair.map(|i| i as usize));
        let PartTable { owners, part_states, pair_materials, .. } = self.table;
        let (owner_a, owner_b) = (owners[a as usize], owners[b as usize]);
        let [(entry_a, part_a), (entry_b, part_b)] = [a, b].map(|row| self.table.entry(row));
        if !may_collide(&entry_a, part_a, &entry_b, part_b, part_states) {
            return;
        }
        let (Some(body_a), Some(body_b)) = (entry_a.object.collidable(), entry_b.object.collidable()) else { return };
        let key = [entry_a.serial, owner_a.part, entry_b.serial, owner_b.part];
        let moves = |entry: &Entry, body: &dyn Collidable, part| entry.moves() && body.part_moves(part);
        let is_known = self.reach.known.binary_search(&key).is_ok();
        if is_known && moves(&entry_a, body_a, part_a) && moves(&entry_b, body_b, part_b) {
            return;
        }
        let (state_a, state_b) = (&part_states[a as usize], &part_states[b as usize]);
        let (Some(side_a), Some(side_b)) = (self.table.part(a), self.table.part(b)) else { return };
        let filtered = FilteredPart::pair([side_a, side_b]);
        let vary = !body_a.shape_materials(part_a).is_empty() || !body_b.shape_materials(part_b).is_empty();
        let ignored = || {
            let [of_a, of_b] = [body_a.material(part_a).id, body_b.material(part_b).id];
            pair_materials.ignores((owner_a.id, part_a, of_a), (owner_b.id, part_b, of_b))
        };
        if filtered.is_none() && !pair_materials.ignores_none() && ignored() {
            return;
        }
        let mode = body_a.contact_mode(part_a).of_pair(body_b.contact_mode(part_b));
        let pair = PairQuery {
            parts: MovingPair {
                mode,
                shapes: [side_a.shape, side_b.shape],
                tests: OwnTests::of([(entry_a.object, part_a), (entry_b.object, part_b)]),
                filtered,
                part_states: [state_a, state_b],
                plane: None,
                skipped: &[],
            },
            motion_bounds: [self.motion_bounds[i], self.motion_bounds[j]],
            near: self.near,
            prediction: self.reach.prediction,
        };
        if pair.is_expensive() && pair.is_separated() {
            return;
        }
        let Found { contact_constraints: out, needs_wake, cached, contacts: found } = results;
        let time = pair.contacts([a, b], self.reach.horizon, (known, cached), found);
        if found.is_empty() {
            return;
        }
        let [of_a, of_b] = [body_a.material(part_a), body_b.material(part_b)];
        let surfaces = PairSurfaces {
            settings: self.settings,
            pair_materials,
            part_states: [state_a, state_b],
            whole: [(owner_a.id, part_a, &of_a), (owner_b.id, part_b, &of_b)],
            of_shapes: [body_a.shape_materials(part_a), body_b.shape_materials(part_b)],
        };
        let first = out.len();
        if let Some(sleeper) = [entry_a, entry_b].into_iter().find(|e| e.asleep) {
            // the frame will be repeated with it awake
            needs_wake.extend((!found.is_empty()).then_some(sleeper.serial));
            return;
        }
        let mut shapes = [0; 2];
        let mut surface = surfaces.laws(shapes);
        let mut frame = ContactFrame { point: Vec3::zeros(), axes: [Vec3::zeros(); 3] };
        out.extend(found.iter().map(|contact| {
            let other = vary && contact.shapes != shapes;
            if other {
                (shapes, surface) = (contact.shapes, surfaces.laws(contact.shapes));
            }
            if other || contact.normal != frame.axes[0] {
                frame = ContactLaws::frame(surface.laws.as_deref(), contact.point, contact.normal);
            }
            ContactConstraint {
                a,
                b,
                contact: *contact,
                offset: Vec3::zeros(),
                found_at: 0.0,
                moved: Moved::default(),
                frame: ContactFrame { point: contact.point, ..frame },
                friction: surface.friction,
                restitution: surface.restitution,
                surface_velocity: surface.surface_velocity,
                laws: surface.laws.clone(),
                plane: None,
                key: ContactKey { pair: key, feature: contact.feature },
            }
        }));
        if time > 0.0 {
            out[first..].iter_mut().for_each(|constraint| {
                constraint.move_to_impact(&constraint.contact.clone(), [state_a, state_b], time)
            });
        }
    }
}

/// Returns whether two parts are to be tested: one of them moves (or is kinematic and approaches a
/// sleeping object), none is a sensor, and both collision groups allow it. Shapes with filters of their own are not compared.
pub(crate) fn may_collide(a: &Entry, part_a: usize, b: &Entry, part_b: usize, part_states: &[PartState]) -> bool {
    let (Some(ca), Some(cb)) = (a.object.collidable(), b.object.collidable()) else { return false };
    let wakes = a.asleep && b.approaches(part_states) || b.asleep && a.approaches(part_states);
    if !(wakes || a.moves() && ca.part_moves(part_a) || b.moves() && cb.part_moves(part_b)) {
        return false;
    }
    if a.serial == b.serial && !ca.parts_collide(part_a, part_b) {
        return false;
    }
    // shapes with filters of their own are compared one by one, when their contacts are found
    if !(ca.shape_filters(part_a).is_empty() && cb.shape_filters(part_b).is_empty()) {
        return true;
    }
    if ca.is_sensor(part_a) || cb.is_sensor(part_b) {
        return false;
    }
    ca.collides_with(part_a, cb.collision_group(part_b)) && cb.collides_with(part_b, ca.collision_group(part_a))
}

impl ContactConstraint {
    /// Returns the contact point of B, m.
    pub fn point_b(&self) -> Vec3 {
        self.contact.point + self.offset
    }

    /// Returns the coefficient of tangential restitution.
    pub fn reversal(&self) -> f64 {
        self.laws.as_ref().map_or(0.0, |laws| laws.tangential_restitution)
    }

    /// Returns the frame of the contact at a point, m, with a normal.
    pub fn frame_at(&self, point: Vec3, normal: Vec3) -> ContactFrame {
        ContactLaws::frame(self.laws.as_deref(), point, normal)
    }

    /// Returns the relative velocity of A against B at the contact, m/s; negative along the normal
    /// if they approach.
    pub fn velocity(&self, a: &PartState, b: &PartState) -> Vec3 {
        a.velocity_at(&self.contact.point) - b.velocity_at(&self.point_b())
    }
}
