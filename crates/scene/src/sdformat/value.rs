//! Values of SDF: the text of an element.

use crate::notes::NoteList;
use crate::parse::bound::Bound;
use crate::xml::{Element, MAX_MAGNITUDE};

/// Returns the text of an element without surrounding white space; empty if it has none.
pub(super) fn text<'a>(element: &Element<'a, '_>) -> &'a str {
    element.node().text().unwrap_or("").trim()
}

/// Returns the text of the first child with that tag, if there is one.
pub(super) fn child_text<'a>(element: &Element<'a, '_>, tag: &'static str) -> Option<&'a str> {
    element.child(tag).map(|child| text(&child))
}

/// Records that the value of an element is wrong.
pub(super) fn wrong(element: &Element<'_, '_>, expected: impl std::fmt::Display) {
    let given: String = text(element).chars().take(48).map(|c| if c.is_control() { ' ' } else { c }).collect();
    element.problem(format_args!("is \"{given}\""), format!("expected {expected}"));
}

/// Returns `N` numbers of an element. `None`, with the problem recorded, if it has others.
pub(super) fn numbers<const N: usize>(element: &Element<'_, '_>, bound: Bound) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = text(element).split_whitespace().take(N + 1).map(|word| word.parse().ok()).collect();
    let array = all.and_then(|all| <[f64; N]>::try_from(all).ok()).filter(|a| a.iter().all(|x| bound.holds(*x)));
    if array.is_none() {
        let count = if N == 1 { "one number".into() } else { format!("{N} numbers separated by spaces") };
        wrong(element, format_args!("{count}: {}", bound.expected()));
    }
    array
}

/// Returns red, green and blue from 0 to 1 of a color: three numbers, or four with the opacity.
pub(super) fn color(element: &Element<'_, '_>) -> Option<[f64; 3]> {
    let rgb = match text(element).split_whitespace().count() {
        3 => numbers::<3>(element, Bound::ANY),
        _ => numbers::<4>(element, Bound::ANY).map(|[r, g, b, _]| [r, g, b]),
    };
    rgb.map(|rgb| rgb.map(|x| x.clamp(0.0, 1.0)))
}

/// Returns the number of the first child with that tag, or the default of the format.
pub(super) fn number(element: &Element<'_, '_>, tag: &'static str, bound: Bound, default: f64) -> f64 {
    element.child(tag).and_then(|child| numbers::<1>(&child, bound)).map_or(default, |[x]| x)
}

/// As [`number`], for one end of a range: infinite if its magnitude is beyond 1e12.
pub(super) fn open_number(element: &Element<'_, '_>, tag: &'static str, default: f64) -> f64 {
    let Some(child) = element.child(tag) else { return default };
    match text(&child).parse::<f64>() {
        Ok(x) if x.is_nan() => {
            wrong(&child, "a number");
            default
        }
        Ok(x) if x.abs() > MAX_MAGNITUDE => f64::INFINITY.copysign(x),
        Ok(x) => x,
        Err(_) => {
            wrong(&child, "a number");
            default
        }
    }
}

/// Returns a required number above 0. The result is not finite if it is missing or wrong.
pub(super) fn length(element: &Element<'_, '_>, tag: &'static str) -> f64 {
    let child = element.required(tag, &format!("<{tag}>, m"));
    child.and_then(|child| numbers::<1>(&child, Bound::POSITIVE)).map_or(f64::NAN, |[x]| x)
}

/// Returns whether a flag of the format is set.
pub(super) fn flag(element: &Element<'_, '_>, tag: &'static str, default: bool) -> bool {
    let Some(child) = element.child(tag) else { return default };
    match text(&child).to_ascii_lowercase().as_str() {
        "true" | "1" => true,
        "false" | "0" => false,
        _ => {
            wrong(&child, "true, false, 1 or 0");
            default
        }
    }
}

/// Notes all children but those with these tags.
pub(super) fn note_others(element: &Element<'_, '_>, read: &[&str], notes: &mut NoteList) {
    for child in element.node().children().filter(|node| node.is_element()) {
        let child = Element::new(element.log, child);
        if !read.contains(&child.tag()) {
            let tag: String = child.tag().chars().take(48).collect();
            note(&child, format!("<{tag}> is left out"), notes);
        }
    }
}

/// Notes a text about an element, with file and line.
pub(super) fn note(element: &Element<'_, '_>, text: impl Into<String>, notes: &mut NoteList) {
    notes.add(format!("{}: {}", element.place(), element.what()), text);
}
