//! NetSync from outside.

mod compute;
mod events;
mod faults;
mod following;
mod hostile;
mod links;
mod lockstep;
mod mirror;
mod pace;
mod places;
mod quantize;
mod queries;
mod refusals;
mod reports;
pub mod simulated_session;
mod threads;
mod times;
