//! Tests of `tumble-calibrate`.

// the fuzz target asks for its macro by this name
extern crate self as libfuzzer_sys;

mod calibrate;
mod fuzz;
mod mpcdi;
mod rehearsal;
mod sgct;
