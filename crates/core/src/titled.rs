//! Titles of objects in errors.

/// Returns `sensor 'imu'`, or `the new sensor` for an object without a name: it is not in a world yet.
pub(crate) fn titled(kind: &str, name: &str) -> String {
    match name {
        "" => format!("the new {kind}"),
        name => format!("{kind} '{name}'"),
    }
}
