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
mod threads;
mod times;
pub mod stage;
