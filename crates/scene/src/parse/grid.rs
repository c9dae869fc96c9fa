//! `[[grid]]`: a body repeated in rows, layers or a triangle.
//!
//! All keys of a body apply to each copy; copy *k* (from 1) of a grid named `ball` is `ball_k`.
//! `box` counts along x first, then y, then z. `triangle` has 1, 2, 3, … bodies per row. Its rows
//! are `√3/2` of the spacing apart along the horizontal direction `toward`, and each row runs from
//! left to right as seen along it, so the pins of a bowling lane get their usual numbers.

use crate::parse::appearance::{as_color, as_pattern};
use crate::parse::body::{BodySpec, Library};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names, Value};
use toml::de::DeValue;

/// Largest number of bodies of a scene, grids included.
pub(crate) const MAX_BODIES: usize = 1_000_000;

#[derive(Clone, Copy)]
enum Arrangement {
    Box,
    Triangle,
}

const ARRANGEMENTS: Names<Arrangement> = &[("box", Arrangement::Box), ("triangle", Arrangement::Triangle)];

/// Reads a grid and appends its bodies, at most `room`.
pub(crate) fn read(mut f: Fields<'_>, library: &Library<'_>, room: usize, out: &mut Vec<BodySpec>) {
    let template = BodySpec::read(&mut f, library);
    let arrangement = f.choice_or("arrangement", ARRANGEMENTS, Arrangement::Box);
    let offsets = match arrangement {
        Arrangement::Box => read_box(&mut f, room),
        Arrangement::Triangle => read_triangle(&mut f, room),
    };
    let colors = read_cycle(&mut f, "colors", as_color);
    let patterns = read_cycle(&mut f, "patterns", as_pattern);
    let (Some(template), Some(offsets)) = (template, offsets) else {
        return f.finish();
    };
    f.finish();
    for (k, offset) in offsets.into_iter().enumerate() {
        let mut body = template.clone();
        body.name = format!("{}_{}", template.name, k + 1);
        for axis in 0..3 {
            body.position_m[axis] += offset[axis];
        }
        if !colors.is_empty() {
            body.appearance.color = colors[k % colors.len()];
        }
        if !patterns.is_empty() {
            body.appearance.pattern = patterns[k % patterns.len()];
        }
        out.push(body);
    }
}

/// Returns the offsets of a box of bodies; `None`, with the problem recorded, if there are too
/// many.
fn read_box(f: &mut Fields<'_>, room: usize) -> Option<Vec<[f64; 3]>> {
    let count = f.required("count", "the numbers along x, y and z, such as [5, 5, 1]")?;
    let DeValue::Array(items) = count.get_ref() else {
        f.wrong("count", count, "three integers, along x, y and z");
        return None;
    };
    if items.len() != 3 {
        f.wrong("count", count, "three integers, along x, y and z");
        return None;
    }
    let problems = f.log.count();
    let n: Vec<usize> = items.iter().map(|item| f.as_integer("count", item, 1..=MAX_BODIES as u32) as usize).collect();
    let spacing: [f64; 3] = f.vector("spacing_m", Bound::ANY);
    let centered = f.flag_or("centered", false);
    if f.log.count() > problems {
        return None;
    }
    let total = n[0].checked_mul(n[1]).and_then(|xy| xy.checked_mul(n[2]));
    check_total(f, count, total, room)?;
    let start = [0, 1, 2].map(|axis| if centered { -0.5 * (n[axis] - 1) as f64 } else { 0.0 });
    let at = |axis: usize, index: usize| (start[axis] + index as f64) * spacing[axis];
    let mut offsets = Vec::with_capacity(n[0] * n[1] * n[2]);
    for z in 0..n[2] {
        for y in 0..n[1] {
            offsets.extend((0..n[0]).map(|x| [at(0, x), at(1, y), at(2, z)]));
        }
    }
    Some(offsets)
}

/// Returns the offsets of a triangle of bodies from its apex.
fn read_triangle(f: &mut Fields<'_>, room: usize) -> Option<Vec<[f64; 3]>> {
    let value = f.required("rows", "how many rows the triangle has")?;
    let problems = f.log.count();
    let rows = f.as_integer("rows", value, 1..=MAX_BODIES as u32) as usize;
    let spacing = f.number("spacing_m", Bound::POSITIVE);
    let toward = f.direction_or("toward", [1.0, 0.0, 0.0]);
    if toward[2] != 0.0
        && let Some(value) = f.value("toward")
    {
        f.wrong("toward", value, "a horizontal direction: its third number 0");
    }
    if f.log.count() > problems {
        return None;
    }
    check_total(f, value, rows.checked_mul(rows + 1).map(|twice| twice / 2), room)?;
    // To the left when looking along `toward` with z up.
    let left = [-toward[1], toward[0]];
    let depth = spacing * 0.75_f64.sqrt();
    let mut offsets = Vec::with_capacity(rows * (rows + 1) / 2);
    for row in 0..rows {
        for k in 0..=row {
            let (ahead, aside) = (row as f64 * depth, (0.5 * row as f64 - k as f64) * spacing);
            offsets.push([toward[0] * ahead + left[0] * aside, toward[1] * ahead + left[1] * aside, 0.0]);
        }
    }
    Some(offsets)
}

fn check_total(f: &Fields<'_>, value: &Value<'_>, total: Option<usize>, room: usize) -> Option<()> {
    match total.is_some_and(|n| n <= room) {
        true => Some(()),
        false => {
            let bodies = total.map_or("far too many".into(), |n| n.to_string());
            let message = format!("{} makes {bodies} bodies", f.what);
            f.log.report(value.span(), message, format!("expected at most {MAX_BODIES} bodies in the whole scene"));
            None
        }
    }
}

/// Reads a list whose entries the copies take in turn; empty if the key is absent.
fn read_cycle<'a, T>(f: &mut Fields<'a>, key: &'static str, read: fn(&Fields<'a>, &str, &'a Value<'a>) -> T) -> Vec<T> {
    let Some(value) = f.value(key) else {
        return Vec::new();
    };
    match value.get_ref() {
        DeValue::Array(items) if !items.is_empty() => items.iter().map(|item| read(f, key, item)).collect(),
        _ => {
            f.wrong(key, value, "a list of one or more entries, which the copies take in turn");
            Vec::new()
        }
    }
}
