//! Whole-system tests live in `tests/` of this package.
