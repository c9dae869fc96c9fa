//! Tests of `tumble-calibrate`.

// the fuzz target asks for its macro by this name
extern crate self as libfuzzer_sys;

mod fuzz;
mod mpcdi;
mod sgct;
