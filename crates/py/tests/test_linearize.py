"""The derivative of a step in Python: numbers, names, and the world as it was. Its accuracy is tested in Rust."""

import numpy as np
import pytest

import tumble


def test_a_pendulum_is_its_closed_form_to_first_order():
    world = tumble.World(dt=1e-4)
    pole = tumble.World.parse(
        """articulated = [{ name = "pole", collidable = false, link = [{ name = "rod", joint = "revolute", axis = [0, 1, 0],
           mass_kg = 2, center_m = [0, 0, -0.5], inertia_kg_m2 = [0.01, 0.01, 0.01] }] }]
           world = { dt_s = 0.0001 }"""
    )
    body = pole.bodies["pole"]
    body.q = [0.3]
    before = pole.save()
    A, B = pole.linearize()
    assert pole.save() == before
    inertia = 0.01 + 2 * 0.25
    dt = world.dt
    slope = -2 * 9.81 * 0.5 * np.cos(0.3) / inertia
    assert np.allclose(A, [[1, dt], [dt * slope, 1]], atol=1e-6)
    assert np.allclose(B, [[dt**2 / 2 / inertia], [dt / inertia]], rtol=1e-3)


def test_generalized_forces_that_act_are_those_of_the_step(root):
    world = tumble.World()
    arm = world.add_articulation(root / "scenes" / "robot" / "arm.urdf")
    arm.tau = np.linspace(1, 2, arm.dof)
    step = world.linearize()
    n = arm.dof
    assert step.A.shape == (2 * n, 2 * n) and step.B.shape == (2 * n, n)
    assert step.objects == [(arm.name, 0, n)] and not step.indeterminate and step.residual < 1e-10
    moved, other = world.fork(), world.fork()
    other.bodies[0].tau = arm.tau + 1e-4 * np.eye(n)[1]
    moved.step(), other.step()
    slope = (other.bodies[0].qd - moved.bodies[0].qd) / 1e-4
    assert np.allclose(slope, step.B[n:, 1], atol=1e-6 * np.abs(step.B).max())


def test_a_body_at_rest_names_its_kink():
    world = tumble.World()
    world.add_static("ground", tumble.HalfSpace())
    world.add_rigid("box", tumble.Box((0.2, 0.2, 0.2)), mass=1, position=(0, 0, 0.1))
    for _ in range(30):
        world.step()
    kinds = world.linearize().switches
    assert any(kind == "gap" and set(names or ()) == {"ground", "box"} for kind, names in kinds)


def test_what_cannot_be_linearized_is_refused():
    with pytest.raises(tumble.InvalidValueError, match="set the stepper 'time_stepping'"):
        tumble.World(stepper="backtracking").linearize()

    class Lift(tumble.Force):
        def apply(self, view):
            pass

    world = tumble.World()
    world.add_force("lift", Lift())
    with pytest.raises(tumble.InvalidValueError, match="calls? Python"):
        world.linearize()
