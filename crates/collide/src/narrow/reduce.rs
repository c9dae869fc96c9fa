//! Manifold reduction: few points that keep the deepest one and the area.
//!
//! All points of one manifold share a normal. Kept, in this order: the deepest; the furthest from it; the one that
//! makes the greatest triangle; the one furthest out on the other side of it. Ties go to the earlier point.

use crate::{Contact, NormalFrom, Pose, Vec3};

/// Keeps at most four of `out[start..]`, in the order they were found.
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

/// Index of the greatest score; the first one wins unless a later one is greater by more than rounding.
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

/// The greatest area that `p` adds to a triangle beyond one of its sides.
fn outside_triangle([a, b, c]: [Vec3; 3], side: f64, normal: &Vec3, p: Vec3) -> f64 {
    [(a, b), (b, c), (c, a)]
        .iter()
        .map(|(u, v)| -side * (v - u).cross(&(p - u)).dot(normal))
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Contacts whose normals are within this cosine of the deepest one's belong together.
const CLUSTER_COSINE: f64 = 0.85;
/// Above this many, those found so far are reduced, so that a deep overlap costs no memory.
const MAX_PENDING: usize = 512;
/// At most this many sides.
const MAX_CLUSTERS: usize = 8;

/// Gathers the many contacts of leaf spheres in B's frame at the end of `out` and keeps few.
///
/// Contacts are clustered by normal, the deepest first. Of each cluster are kept the deepest, and for each of five
/// directions the point that would touch first if A tilted a little that way: the vertices of the manifold's lower
/// hull, which is what it can rest on. Three more stand for a wider tilt, if they are others.
///
/// Once more than a few hundred were gathered the overlap is wide; if it is also deep (by more than a band below the
/// deepest), the shallow ones tell nothing that the deep ones do not, and are no longer asked for.
pub(super) struct Collector<'a> {
    out: &'a mut Vec<Contact>,
    start: usize,
    limit: f64,
    band: f64,
    /// The deepest overlap that no element faces.
    fallback: Option<Contact>,
}

/// The band, as a part of the smaller body's radius.
const BAND: f64 = 0.05;

impl<'a> Collector<'a> {
    /// `radius` is that of the smaller body.
    pub fn new(margin: f64, radius: f64, out: &'a mut Vec<Contact>) -> Collector<'a> {
        Collector { start: out.len(), out, limit: margin, band: BAND * radius, fallback: None }
    }

    /// Only contacts with a gap up to this are wanted.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    pub fn push(&mut self, contact: Contact) {
        if self.out.len() - self.start >= MAX_PENDING {
            self.reduce();
            // the first one kept is the deepest
            self.limit = self.limit.min(self.out[self.start].gap + self.band);
        }
        self.out.push(contact);
    }

    /// Whether any that was found and kept is like this.
    pub fn contains_like(&self, like: impl Fn(&Contact) -> bool) -> bool {
        self.out[self.start..].iter().any(like)
    }

    /// The least gap found.
    pub fn min_gap(&self) -> f64 {
        self.out[self.start..].iter().map(|c| c.gap).fold(f64::INFINITY, f64::min)
    }

    /// The contact that has it.
    pub fn deepest(&self) -> Option<&Contact> {
        self.out[self.start..].iter().min_by(|x, y| x.gap.total_cmp(&y.gap))
    }

    /// Forgets what was found, and takes contacts with a gap up to another limit; returns the one before.
    pub fn restart(&mut self, limit: f64) -> f64 {
        self.out.truncate(self.start);
        self.fallback = None;
        std::mem::replace(&mut self.limit, limit)
    }

    /// Changes all contacts found, and keeps those that it is said of and that are within the limit, which is set anew.
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

    /// How far the two overlap as far as is known, places that no element faces included, meters; below 0 where they do not.
    pub fn penetration(&self) -> f64 {
        -self.fallback.iter().map(|c| c.gap).fold(self.min_gap(), f64::min)
    }

    /// A deep overlap at a place that the element does not face: it counts only if nothing else overlaps.
    pub fn push_fallback(&mut self, contact: Contact) {
        if contact.gap < -0.02 * self.band && self.fallback.is_none_or(|s| contact.gap < s.gap) {
            self.fallback = Some(contact);
        }
    }

    /// Reduces what was gathered and turns it into world axes.
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
        // `found[..kept]` are kept, `found[rest..]` are in no cluster yet
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

/// Moves the deepest contact to the front and all that face its way next to it; returns how many those are.
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

/// Moves to the front the deepest contact of a cluster (its first) and its support points; returns how many.
///
/// Of contacts that support within `slack` of one another, the one with the least feature is kept, so that the choice lasts.
///
/// Where contacts are looked for `far` away, wider tilts follow. Where the two touch (the deepest gap is less than `touching_gap`), finer ones do: a base that is
/// flat but for rounding rests on places that are deeper than others by a micrometer; were one left out it would sink, become the deepest and be kept while
/// another one is not, and so on without end.
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

/// Of the contacts whose score is within `slack` of the greatest, the one with the least feature.
fn support_of_least_feature(cluster: &[Contact], slack: f64, score: impl Fn(&Contact) -> f64) -> usize {
    let most = cluster.iter().map(&score).fold(f64::NEG_INFINITY, f64::max);
    let near = (0..cluster.len()).filter(|&n| score(&cluster[n]) >= most - slack);
    near.min_by_key(|&n| cluster[n].feature).unwrap_or(0)
}

/// Differences of support that count as none, in bands ([`BAND`]): 1e-5 of the smaller body's radius.
const SUPPORT_TOLERANCE: f64 = 2e-4;

/// Tilts (tangents of their angles) and directions for which a cluster's support point is kept: all five for what the
/// body rests on, three for what it may swing onto within a step. On a flat base the wide ones find the same points
/// again.
const SUPPORTS: [(f64, usize); 8] =
    [(0.02, 0), (0.02, 1), (0.02, 2), (0.02, 3), (0.02, 4), (0.15, 0), (0.15, 2), (0.15, 3)];
/// Gaps up to this are those of bodies that touch, in bands ([`BAND`]): 1e-3 of the smaller body's radius.
const TOUCHING_GAP: f64 = 2e-2;
/// Parts of the tilt that are looked for then: down to 6e-7.
const FINE_TILTS: [f64; 5] = [0.125, 0.016, 2e-3, 2.5e-4, 3e-5];
/// Contacts looked for so far away, in bands, are those of fast bodies: 15 % of the smaller one's radius.
const FAST_MARGIN: f64 = 3.0;
/// Tilts for those: what strikes with one corner may swing onto any other in the same step.
const WIDE_TILTS: [f64; 2] = [0.5, 2.0];
/// Corners of a regular pentagon.
const DIRECTIONS: [(f64, f64); 5] = [
    (1.0, 0.0),
    (0.309_016_994_374_947_45, 0.951_056_516_295_153_5),
    (-0.809_016_994_374_947_5, 0.587_785_252_292_473_1),
    (-0.809_016_994_374_947_5, -0.587_785_252_292_473_1),
    (0.309_016_994_374_947_45, -0.951_056_516_295_153_5),
];
