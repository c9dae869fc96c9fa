//! NetSync from outside.

mod faults;
mod hostile;
mod links;
mod lockstep;
mod mirror;
mod pace;
mod quantise;
mod threads;
mod times;
pub mod stage;
