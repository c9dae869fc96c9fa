//! Manifold reduction: few points that preserve the deepest one and the area.
//!
//! All points of one manifold share a normal. Kept, in this order: the deepest; the furthest from
//! it; the one that makes the largest triangle; the one furthest outside on the other side of it.
//! Ties go to the earlier point.

use crate::{Contact, NormalFrom, Pose, Vec3};

/// Keeps at most four of `out[start..]`, in their order.
pub(super) fn reduce_to_four(out: &mut Vec<Contact>, start: usize) {
    if out.len() - start <= 4 {
        return;
    }
    let points = &out[start..];
    let normal = points[0].normal;
    let p = |n: usize| points[n].point;
    let first = arg_max(points.len(), |n| -points[n].gap);
    let second = arg_max(points.len(), |n| (p(n) - p(first)).norm_squared());
    let area = |n: usize| (p(second) - p(first)).cross(&(p(n) - p(first))).dot(&normal);
    let third = arg_max(points.len(), |n| area(n).abs());
    let side = if area(third) < 0.0 { -1.0 } else { 1.0 };
    let outside = |n: usize| outside_triangle([p(first), p(second), p(third)], side, &normal, p(n));
    let fourth = arg_max(points.len(), outside);
    let mut keep = [first, second, third, fourth];
    keep.sort_unstable();
    let mut length = start;
    for (n, &index) in keep.iter().enumerate() {
        if n == 0 || index != keep[n - 1] {
            out[length] = out[start + index];
            length += 1;
        }
    }
    out.truncate(length);
}

/// Returns the index of the greatest score. The first one wins unless a later one is greater by
/// more than rounding.
fn arg_max(count: usize, score: impl Fn(usize) -> f64) -> usize {
    let mut found = (0, score(0));
    for n in 1..count {
        let s = score(n);
        if s > found.1 + 1e-9 * found.1.abs() {
            found = (n, s);
        }
    }
    found.0
}

/// Returns the largest area that `p` adds to a triangle beyond one of its sides.
fn outside_triangle([a, b, c]: [Vec3; 3], side: f64, normal: &Vec3, p: Vec3) -> f64 {
    [(a, b), (b, c), (c, a)]
        .iter()
        .map(|(u, v)| -side * (v - u).cross(&(p - u)).dot(normal))
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Cosine to the normal of the deepest contact above which a contact belongs to the same cluster.
const CLUSTER_COSINE: f64 = 0.85;
/// Number of pending contacts above which they are reduced, so that a deep overlap needs little
/// memory.
const MAX_PENDING: usize = 512;
/// Maximum number of clusters.
const MAX_CLUSTERS: usize = 8;

/// Collects the contacts of two bodies in B's frame at the end of `out` and reduces them.
///
/// Contacts are clustered by normal, the deepest first. Each cluster keeps its deepest contact, and
/// for each of five directions the point that would touch first if A tilted slightly in that
/// direction: the vertices of the lower hull of the manifold, on which A can rest. Three more
/// points are kept for a larger tilt if they are different.
///
/// After a few hundred contacts the overlap is wide. If it is also deep (by more than a band below
/// the deepest contact), shallow contacts add nothing, and the limit excludes them.
pub(super) struct Collector<'a> {
    out: &'a mut Vec<Contact>,
    start: usize,
    limit: f64,
    band: f64,
    /// The deepest contact that no element faces.
    fallback: Option<Contact>,
}

/// Width of the band, as a fraction of the smaller body's radius.
const BAND: f64 = 0.05;

impl<'a> Collector<'a> {
    /// Returns an empty collector. `radius` is that of the smaller body.
    pub fn new(margin: f64, radius: f64, out: &'a mut Vec<Contact>) -> Collector<'a> {
        Collector { start: out.len(), out, limit: margin, band: BAND * radius, fallback: None }
    }

    /// Returns the largest gap of contacts that are still needed.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    pub fn push(&mut self, contact: Contact) {
        if self.out.len() - self.start >= MAX_PENDING {
            self.reduce();
            // the first contact kept is the deepest
            self.limit = self.limit.min(self.out[self.start].gap + self.band);
        }
        self.out.push(contact);
    }

    /// Returns whether some collected contact satisfies `like`.
    pub fn contains_like(&self, like: impl Fn(&Contact) -> bool) -> bool {
        self.out[self.start..].iter().any(like)
    }

    /// Returns the contacts collected.
    pub fn contacts(&self) -> &[Contact] {
        &self.out[self.start..]
    }

    /// Returns the smallest gap collected.
    pub fn min_gap(&self) -> f64 {
        self.out[self.start..].iter().map(|c| c.gap).fold(f64::INFINITY, f64::min)
    }

    /// Returns the contact with the smallest gap.
    pub fn deepest(&self) -> Option<&Contact> {
        self.out[self.start..].iter().min_by(|x, y| x.gap.total_cmp(&y.gap))
    }

    /// Returns the contact with the smallest gap; if none overlaps, the one that no element faces.
    pub fn deepest_mut(&mut self) -> Option<&mut Contact> {
        let deepest = self.out[self.start..].iter_mut().min_by(|x, y| x.gap.total_cmp(&y.gap));
        match deepest {
            Some(deepest) if deepest.gap < 0.0 => Some(deepest),
            _ => self.fallback.as_mut(),
        }
    }

    /// Drops all contacts and sets a new limit. Returns the old limit.
    pub fn restart(&mut self, limit: f64) -> f64 {
        self.out.truncate(self.start);
        self.fallback = None;
        std::mem::replace(&mut self.limit, limit)
    }

    /// Sets a new limit, changes all contacts, and keeps those within the limit for which `change`
    /// returns true.
    pub fn map_and_retain(&mut self, limit: f64, mut change: impl FnMut(&mut Contact) -> bool) {
        self.limit = limit;
        let mut kept = self.start;
        for n in self.start..self.out.len() {
            let mut contact = self.out[n];
            if change(&mut contact) && contact.gap <= limit {
                self.out[kept] = contact;
                kept += 1;
            }
        }
        self.out.truncate(kept);
        self.fallback = None;
    }

    /// Returns the known penetration, meters, including contacts that no element faces; below 0
    /// without overlap.
    pub fn penetration(&self) -> f64 {
        -self.fallback.iter().map(|c| c.gap).fold(self.min_gap(), f64::min)
    }

    /// Stores a deep contact at a point that the element does not face; used only if nothing else
    /// overlaps.
    pub fn push_fallback(&mut self, contact: Contact) {
        if contact.gap < -0.02 * self.band && self.fallback.is_none_or(|s| contact.gap < s.gap) {
            self.fallback = Some(contact);
        }
    }

    /// Reduces the contacts and transforms them to world axes.
    pub fn finish(mut self, pose_b: &Pose) {
        if self.out[self.start..].iter().all(|c| c.gap >= 0.0) {
            self.out.extend(self.fallback);
        }
        self.reduce();
        for contact in &mut self.out[self.start..] {
            contact.point = (pose_b * nalgebra::Point3::from(contact.point)).coords;
            contact.normal = pose_b.rotation * contact.normal;
            if let NormalFrom::LineOfA(along) | NormalFrom::LineOfB(along) = &mut contact.normal_from {
                *along = pose_b.rotation * *along;
            }
        }
    }

    fn reduce(&mut self) {
        let (slack, touching_gap, far) =
            (SUPPORT_TOLERANCE * self.band, TOUCHING_GAP * self.band, self.limit > FAST_MARGIN * self.band);
        let found = &mut self.out[self.start..];
        // `found[..kept]` are kept, `found[rest..]` are not yet in a cluster
        let (mut kept, mut rest) = (0, 0);
        for _ in 0..MAX_CLUSTERS {
            if rest == found.len() {
                break;
            }
            let end = rest + gather_cluster(&mut found[rest..]);
            let count = keep_supports(&mut found[rest..end], slack, touching_gap, far);
            for n in 0..count {
                found.swap(kept + n, rest + n);
            }
            kept += count;
            rest = end;
        }
        let length = self.start + kept;
        self.out.truncate(length);
    }
}

/// Moves the deepest contact to the front, followed by all with a similar normal. Returns their
/// number.
fn gather_cluster(found: &mut [Contact]) -> usize {
    let deeper = |a: &Contact, b: &Contact| a.gap < b.gap || (a.gap == b.gap && a.feature < b.feature);
    let deepest = (1..found.len()).fold(0, |best, n| if deeper(&found[n], &found[best]) { n } else { best });
    found.swap(0, deepest);
    let normal = found[0].normal;
    let mut end = 1;
    for n in 1..found.len() {
        if found[n].normal.dot(&normal) >= CLUSTER_COSINE {
            found.swap(end, n);
            end += 1;
        }
    }
    end
}

/// Moves the deepest contact of a cluster (its first) and its support points to the front. Returns
/// their number.
///
/// Of contacts that support within `slack` of one another, the one with the smallest feature is
/// kept, so that the selection is stable.
///
/// For a `far` margin, larger tilts are added. For bodies that touch (the deepest gap is less than
/// `touching_gap`), smaller tilts are added. The reason: a base that is flat up to rounding rests
/// on points that are deeper than others by a micrometer. If one of them were left out, the base
/// would sink there until that point is the deepest and another one is left out, and so on.
fn keep_supports(cluster: &mut [Contact], slack: f64, touching_gap: f64, far: bool) -> usize {
    let (normal, deepest) = (cluster[0].normal, cluster[0].gap);
    let u = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
    let v = normal.cross(&u);
    let mut kept = 1;
    let mut keep = |tilt: f64, n: usize, slack: f64| {
        let (x, y) = DIRECTIONS[n];
        let direction = (u * x + v * y) * tilt;
        let support = support_of_least_feature(cluster, slack, |c| direction.dot(&c.point) - c.gap);
        if support >= kept {
            cluster.swap(kept, support);
            kept += 1;
        }
    };
    SUPPORTS.iter().for_each(|&(tilt, n)| keep(tilt, n, slack));
    if far {
        WIDE_TILTS.iter().for_each(|&tilt| (0..DIRECTIONS.len()).for_each(|n| keep(tilt, n, slack)));
    }
    if deepest.abs() < touching_gap {
        for fine_tilt in FINE_TILTS {
            (0..DIRECTIONS.len()).for_each(|n| keep(fine_tilt * SUPPORTS[0].0, n, fine_tilt * slack));
        }
    }
    kept
}

/// Returns the contact with the smallest feature among those whose score is within `slack` of the
/// greatest.
fn support_of_least_feature(cluster: &[Contact], slack: f64, score: impl Fn(&Contact) -> f64) -> usize {
    let most = cluster.iter().map(&score).fold(f64::NEG_INFINITY, f64::max);
    let near = (0..cluster.len()).filter(|&n| score(&cluster[n]) >= most - slack);
    near.min_by_key(|&n| cluster[n].feature).unwrap_or(0)
}

/// Differences of support that are treated as equal, in bands ([`BAND`]): 1e-5 of the smaller
/// body's radius.
const SUPPORT_TOLERANCE: f64 = 2e-4;

/// Tilts (tangents of their angles) and directions for which the support points of a cluster are
/// kept: all five for the points on which the body rests, three for the points that it can reach
/// within a step. On a flat base the large tilts find the same points again.
const SUPPORTS: [(f64, usize); 8] =
    [(0.02, 0), (0.02, 1), (0.02, 2), (0.02, 3), (0.02, 4), (0.15, 0), (0.15, 2), (0.15, 3)];
/// Largest gap of bodies that touch, in bands ([`BAND`]): 1e-3 of the smaller body's radius.
const TOUCHING_GAP: f64 = 2e-2;
/// Factors of the smaller tilts for bodies that touch; the smallest tilt is 6e-7.
const FINE_TILTS: [f64; 5] = [0.125, 0.016, 2e-3, 2.5e-4, 3e-5];
/// Margin, in bands, above which bodies are fast: 15 % of the smaller one's radius.
const FAST_MARGIN: f64 = 3.0;
/// Tilts for fast bodies: after one corner strikes, any other can follow in the same step.
const WIDE_TILTS: [f64; 2] = [0.5, 2.0];
/// Corners of a regular pentagon.
const DIRECTIONS: [(f64, f64); 5] = [
    (1.0, 0.0),
    (0.309_016_994_374_947_45, 0.951_056_516_295_153_5),
    (-0.809_016_994_374_947_5, 0.587_785_252_292_473_1),
    (-0.809_016_994_374_947_5, -0.587_785_252_292_473_1),
    (0.309_016_994_374_947_45, -0.951_056_516_295_153_5),
];
