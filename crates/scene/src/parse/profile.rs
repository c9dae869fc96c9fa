//! The profile of a lathe: points `[r, z]` whose line, revolved about z, bounds a solid.

use toml::de::DeValue;

use crate::parse::bound::Bound;
use crate::parse::fields::Fields;

/// Largest number of points of a profile.
const MAX_POINTS: usize = 1000;
const WANTED: &str =
    "a list of 3 to 1000 points [r, z] in meters, from the bottom of the axis (r = 0) to its top (r = 0)";

/// Reads a profile and checks that it bounds a solid. Returns `None`, with the problem recorded, if
/// it does not.
pub(crate) fn read(f: &mut Fields<'_>, key: &'static str) -> Option<Vec<[f64; 2]>> {
    let value = f.required(key, WANTED)?;
    let DeValue::Array(items) = value.get_ref() else {
        f.wrong(key, value, WANTED);
        return None;
    };
    if !(3..=MAX_POINTS).contains(&items.len()) {
        f.wrong(key, value, WANTED);
        return None;
    }
    let problems = f.log.count();
    let points: Vec<[f64; 2]> = items.iter().map(|item| f.as_vector(key, item, Bound::ANY)).collect();
    if f.log.count() > problems {
        return None;
    }
    match fault(&points) {
        None => Some(points),
        Some((index, expected)) => {
            f.wrong(key, &items[index], expected);
            None
        }
    }
}

/// Returns the first point because of which the profile does not bound a solid, and what is
/// expected there.
fn fault(points: &[[f64; 2]]) -> Option<(usize, String)> {
    let last = points.len() - 1;
    for (index, &[r, _]) in points.iter().enumerate() {
        let on_axis = index == 0 || index == last;
        if on_axis && r != 0.0 {
            return Some((index, "r = 0 at both ends, so that the solid is closed".into()));
        }
        if !on_axis && r < 1e-9 {
            return Some((index, "r greater than 0 between the ends".into()));
        }
        if index > 0 && points[index - 1] == points[index] {
            return Some((index, "a point other than the one before it".into()));
        }
    }
    if signed_area(points) <= 0.0 {
        return Some((0, "the points from the bottom of the axis to its top: these run the other way".into()));
    }
    crossing(points)
        .map(|(i, j)| (j, format!("a line that does not cross itself: the side after point {} meets it", i + 1)))
}

/// Returns the area between the profile and the axis, positive if the profile runs upwards: `½ Σ
/// (rᵢ zᵢ₊₁ − rᵢ₊₁ zᵢ)`.
fn signed_area(points: &[[f64; 2]]) -> f64 {
    points.windows(2).map(|w| 0.5 * (w[0][0] * w[1][1] - w[1][0] * w[0][1])).sum()
}

/// Returns the first two sides `(i, i+1)`, `(j, j+1)`, `i + 1 < j`, that intersect.
fn crossing(points: &[[f64; 2]]) -> Option<(usize, usize)> {
    let sides = points.len() - 1;
    for j in 2..sides {
        for i in 0..j - 1 {
            if meet(points[i], points[i + 1], points[j], points[j + 1]) {
                return Some((i, j));
            }
        }
    }
    None
}

/// Returns whether segments `ab` and `cd` share a point.
fn meet(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let side = |p: [f64; 2], q: [f64; 2], s: [f64; 2]| (q[0] - p[0]) * (s[1] - p[1]) - (q[1] - p[1]) * (s[0] - p[0]);
    let within =
        |p: [f64; 2], q: [f64; 2], s: [f64; 2]| (0..2).all(|k| p[k].min(q[k]) <= s[k] && s[k] <= p[k].max(q[k]));
    let (ca, cb, da, db) = (side(c, d, a), side(c, d, b), side(a, b, c), side(a, b, d));
    (ca * cb < 0.0 && da * db < 0.0)
        || (ca == 0.0 && within(c, d, a))
        || (cb == 0.0 && within(c, d, b))
        || (da == 0.0 && within(a, b, c))
        || (db == 0.0 && within(a, b, d))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_is_a_solid_and_its_area_is_half_base_times_height() {
        let cone = [[0.0, 0.0], [2.0, 0.0], [0.0, 3.0]];
        assert_eq!(fault(&cone), None);
        assert_eq!(signed_area(&cone), 3.0);
    }

    #[test]
    fn faults_name_the_point() {
        assert_eq!(fault(&[[0.1, 0.0], [1.0, 0.0], [0.0, 1.0]]).unwrap().0, 0);
        assert_eq!(fault(&[[0.0, 0.0], [-1.0, 0.5], [0.0, 1.0]]).unwrap().0, 1);
        assert_eq!(fault(&[[0.0, 0.0], [1.0, 0.5], [1.0, 0.5], [0.0, 1.0]]).unwrap().0, 2);
        assert_eq!(fault(&[[0.0, 1.0], [1.0, 0.5], [0.0, 0.0]]).unwrap().0, 0);
        // The third side crosses the first.
        let knot = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, -1.0], [3.0, 4.0], [0.0, 4.0]];
        assert_eq!(fault(&knot).unwrap().0, 2);
    }
}
