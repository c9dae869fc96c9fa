//! "Did you mean": the known word nearest to a mistyped one.

/// Returns the word of `known` that `typed` most likely means. First a word that continues it, as
/// `dt_s` continues `dt`. Else the word with the smallest edit distance, at most a third of the
/// typed length and at least one. Else the same quantity in another unit, as `limits_rad` for
/// `limits_m`. Ties go to the earlier word.
pub(crate) fn nearest<'k>(typed: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let letters: Vec<char> = typed.chars().take(64).collect();
    let allowed = (letters.len() / 3).max(1);
    let mut best: Option<(usize, &str)> = None;
    let mut in_another_unit = None;
    for word in known {
        let unit_left_out = word.strip_prefix(typed).is_some_and(|rest| !typed.is_empty() && rest.starts_with('_'));
        let distance = if unit_left_out { 0 } else { edit_distance(&letters, word) };
        if distance <= allowed && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, word));
        }
        if in_another_unit.is_none() && quantity(word) != word && quantity(word) == quantity(typed) {
            in_another_unit = Some(word);
        }
    }
    best.map(|(_, word)| word).or(in_another_unit)
}

/// Returns a key without its unit.
fn quantity(key: &str) -> &str {
    let mut rest = key;
    while let Some((before, last)) = rest.rsplit_once('_')
        && UNITS.contains(&last)
    {
        rest = before;
    }
    rest
}

const UNITS: &[&str] = &["m", "s", "kg", "n", "rad", "deg", "per", "m2", "m3", "s2"];

/// Returns the smallest number of single-letter insertions, deletions, replacements and swaps of
/// adjacent letters that turn `a` into `b` (optimal string alignment: a swapped pair is not edited
/// again).
fn edit_distance(a: &[char], b: &str) -> usize {
    let b: Vec<char> = b.chars().take(64).collect();
    let width = b.len() + 1;
    let mut cost = vec![0; (a.len() + 1) * width];
    for j in 0..width {
        cost[j] = j;
    }
    for i in 1..=a.len() {
        cost[i * width] = i;
        for j in 1..width {
            let replaced = usize::from(a[i - 1] != b[j - 1]);
            let mut least = (cost[(i - 1) * width + j - 1] + replaced)
                .min(cost[(i - 1) * width + j] + 1)
                .min(cost[i * width + j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(cost[(i - 2) * width + j - 2] + 1);
            }
            cost[i * width + j] = least;
        }
    }
    cost[a.len() * width + b.len()]
}

/// Formats words as a list for a message: `a`, `b` or `c`.
pub(crate) fn listed<'k>(words: impl IntoIterator<Item = &'k str>, last: &str) -> String {
    let quoted: Vec<String> = words.into_iter().map(|word| format!("`{word}`")).collect();
    match quoted.split_last() {
        None => "nothing".into(),
        Some((only, [])) => only.clone(),
        Some((end, rest)) => format!("{} {last} {end}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_counted_by_hand() {
        let distance = |a: &str, b: &str| edit_distance(&a.chars().collect::<Vec<_>>(), b);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("raduis", "radius"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("same", "same"), 0);
    }

    #[test]
    fn far_words_are_not_suggested() {
        assert_eq!(nearest("frction", ["restitution", "friction"]), Some("friction"));
        assert_eq!(nearest("banana", ["restitution", "friction"]), None);
        assert_eq!(nearest("", ["restitution"]), None);
    }

    #[test]
    fn a_unit_left_out_is_found() {
        assert_eq!(nearest("gravity", ["dt_s", "gravity_m_per_s2"]), Some("gravity_m_per_s2"));
    }

    #[test]
    fn another_unit_is_found() {
        assert_eq!(nearest("limits_m", ["lights", "limits_rad", "limits_deg"]), Some("limits_rad"));
        assert_eq!(
            nearest("damping_n_s_per_m", ["friction_n_m", "damping_n_m_s_per_rad"]),
            Some("damping_n_m_s_per_rad")
        );
        assert_eq!(nearest("mass_m", ["color", "collidable"]), None);
    }

    #[test]
    fn lists_read_as_prose() {
        assert_eq!(listed(["a"], "or"), "`a`");
        assert_eq!(listed(["a", "b", "c"], "or"), "`a`, `b` or `c`");
    }
}
