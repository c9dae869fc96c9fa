//! NetSync from outside.

mod faults;
mod hostile;
mod links;
mod lockstep;
mod mirror;
mod places;
mod pace;
mod quantise;
mod refusals;
mod threads;
mod times;
pub mod stage;
