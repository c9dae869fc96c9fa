//! NetSync from outside.

mod faults;
mod hostile;
mod links;
mod lockstep;
mod mirror;
mod pace;
mod places;
mod quantise;
mod refusals;
pub mod stage;
mod threads;
mod times;
