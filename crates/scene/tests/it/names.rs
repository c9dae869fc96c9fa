//! Steppers, solvers and integrators have the same names here as in `tumble-core`.

use tumble_core::solver::{NAMES, by_name};
use tumble_core::{STEPPERS, World, stepper_by_name};
use tumble_scene::{Integrator, SceneFile, Solver, Stepper};

/// Returns the names of a list.
fn words<T: Copy>(names: &[(&'static str, T)]) -> Vec<&'static str> {
    names.iter().map(|(word, _)| *word).collect()
}

/// Returns the world of a scene with one key of `[world]`.
fn world_with(key: &str, word: &str) -> World {
    let scene = SceneFile::parse(&format!("[world]\n{key} = \"{word}\"\n"), "s.toml").unwrap();
    scene.build().unwrap().0
}

#[test]
fn steppers_have_one_list_of_names() {
    assert_eq!(words(Stepper::NAMES), STEPPERS);
    for word in STEPPERS {
        assert_eq!(stepper_by_name(word).unwrap().name(), word);
        assert_eq!(world_with("stepper", word).stepper_name(), word);
    }
}

#[test]
fn solvers_have_one_list_of_names() {
    assert_eq!(words(Solver::NAMES), NAMES);
    for word in NAMES {
        assert_eq!(by_name(word).unwrap().name(), word);
        assert_eq!(world_with("solver", word).solver_name(), word);
    }
}

/// The compiler refuses this function if the library has another integrator.
fn word(integrator: tumble_core::Integrator) -> &'static str {
    match integrator {
        tumble_core::Integrator::Verlet => "verlet",
        tumble_core::Integrator::SymplecticEuler => "symplectic_euler",
        tumble_core::Integrator::ExplicitEuler => "explicit_euler",
        tumble_core::Integrator::Rk4 => "rk4",
        tumble_core::Integrator::DormandPrince => "dormand_prince",
    }
}

#[test]
fn integrators_have_the_names_of_their_variants() {
    for (name, integrator) in Integrator::NAMES {
        assert_eq!(word((*integrator).into()), *name);
        assert_eq!(word(world_with("integrator", name).settings().integrator), *name);
    }
    assert_eq!(Integrator::NAMES.len(), 5, "one for each arm of `word`");
}
