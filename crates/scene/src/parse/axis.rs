//! Axes by letter, wherever a direction is read.

/// Returns the unit vector of an axis by its letter: ``x``, ``y``, ``z``, or with a sign as ``-x``.
pub fn axis_by_name(typed: &str) -> Option<[f64; 3]> {
    let (sign, letter) = match typed.strip_prefix('-') {
        Some(letter) => (-1.0, letter),
        None => (1.0, typed.strip_prefix('+').unwrap_or(typed)),
    };
    let axis = ["x", "y", "z"].iter().position(|known| *known == letter)?;
    let mut out = [0.0; 3];
    out[axis] = sign;
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::axis_by_name;

    #[test]
    fn axes_have_their_signs_and_other_words_are_none() {
        assert_eq!(axis_by_name("x"), Some([1.0, 0.0, 0.0]));
        assert_eq!(axis_by_name("+y"), Some([0.0, 1.0, 0.0]));
        assert_eq!(axis_by_name("-z"), Some([0.0, 0.0, -1.0]));
        assert!(["", "-", "X", "xy", "--x", "w"].into_iter().all(|word| axis_by_name(word).is_none()));
    }
}
