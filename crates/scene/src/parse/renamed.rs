//! Keys and values of version 0.1 that were renamed. The error for an old name states the new one;
//! `scripts/migrate_0_1.py` rewrites old files.

/// Old and new names of keys and tables.
const KEYS: &[(&str, &str)] = &[
    ("ahead", "forward"),
    ("alive", "enabled"),
    ("closure", "loop_joint"),
    ("collides", "collidable"),
    ("keep_apart", "exclude_collisions"),
    ("limit_n", "max_force_n"),
    ("limit_n_m", "max_torque_n_m"),
    ("quality", "detail"),
    ("seconds", "duration_s"),
    ("sphere_tree_error", "sphere_tree_max_error"),
    ("start", "initial_positions"),
    ("turned", "initial_rotation"),
];

/// Old and new names of values of `type`.
const VALUES: &[(&str, &str)] =
    &[("hinge", "revolute"), ("point", "spherical"), ("slider", "prismatic"), ("weld", "fixed")];

/// Returns the new name of a key, if it is among the `known` ones.
pub(crate) fn key(old: &str, known: &[&str]) -> Option<&'static str> {
    find(KEYS, old, known)
}

/// Returns the new name of a value of `type`, if it is among the `known` ones.
pub(crate) fn value(key: &str, old: &str, known: &[&str]) -> Option<&'static str> {
    find(VALUES, old, known).filter(|_| key == "type")
}

fn find(names: &[(&str, &'static str)], old: &str, known: &[&str]) -> Option<&'static str> {
    names.iter().find(|(name, new)| *name == old && known.contains(new)).map(|(_, new)| *new)
}
