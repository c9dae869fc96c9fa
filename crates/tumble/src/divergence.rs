//! Detection of simulations that have diverged: their numbers are finite and mean nothing.

use crate::failure::Failure;
use tumble::dynamics::{PartState, World};

/// Speed of light in vacuum, m/s (exact). No body is faster.
const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;

/// Returns an error if a body is faster than light.
pub fn check(world: &World) -> Result<(), Failure> {
    let too_fast = |state: &PartState| state.velocity.norm() > SPEED_OF_LIGHT_M_PER_S;
    if !world.part_states().iter().any(too_fast) {
        return Ok(());
    }
    for &id in world.ids() {
        let mut part = 0;
        while let Some(state) = world.part_state(id, part) {
            if too_fast(state) {
                let (name, speed) = (world.name(id).unwrap_or_default(), state.velocity.norm());
                let why = format!(
                    "at {:.3} s '{name}' moves at {speed:.1e} m/s, faster than light; use a shorter time step or another integrator",
                    world.time()
                );
                return Err(Failure::run("the simulation has diverged", why));
            }
            part += 1;
        }
    }
    Ok(())
}
