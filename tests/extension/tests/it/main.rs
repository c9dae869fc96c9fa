//! The extension's objects in a world, through both steppers, against closed forms.

mod bead;
mod collisions;
mod common;
mod laws;
mod lookout;
mod reactions;
mod rods;
mod stepper;
mod torus;
mod wind;
