//! New kinds meet rigid bodies.
