//! The extension's objects in a world, through both steppers, against closed forms.

mod bead;
mod collisions;
mod common;
mod laws;
mod lookout;
mod rods;
mod stepper;
mod wind;
