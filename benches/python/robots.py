"""Robots in tumble and in MuJoCo: the same file, the same dt, random torques that are the same in both; one world, and 256 in a batch on all cores.

    make bench-robots                                     # installs MuJoCo in target/python once
    target/py-tests/bin/python benches/python/robots.py ant 1024

Steps per second of processor time, of a process that does nothing else; the median of five turns in which the programs take turns. Contacts are hard in tumble and
soft in MuJoCo, so the deepest overlap of the run stands beside the speed. Integrator and solver of MuJoCo are those of its defaults.
"""

import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

import tumble

try:
    import mujoco
    import mujoco.rollout
except ImportError:
    mujoco = None

ROOT = Path(__file__).resolve().parents[2]
OWN, TESTS = ROOT / "crates/py/python/tumble/gym/models", ROOT / "crates/scene/tests/mjcf"
# file, and number of degrees of freedom of the root, which are not driven
MODELS = {
    "cart-pole": (TESTS / "cartpole.xml", 0),
    "two poles": (OWN / "inverted_double_pendulum.xml", 0),
    "swimmer": (OWN / "swimmer.xml", 3),
    "hopper": (OWN / "hopper.xml", 3),
    "walker": (OWN / "walker2d.xml", 3),
    "cheetah": (OWN / "half_cheetah.xml", 3),
    "ant": (OWN / "ant.xml", 6),
    "quadruped": (TESTS / "quadruped.xml", 6),
    "gym humanoid": (OWN / "humanoid.xml", 6),
    "humanoid": (TESTS / "humanoid.xml", 6),
}
TURNS, STEPS = 5, 100
WORLDS = int(sys.argv[2]) if len(sys.argv) > 2 else 256


def rate(run, steps):
    """Steps per second of processor time and of the day's."""
    wall, cpu = time.perf_counter(), time.process_time()
    run()
    return steps / (time.process_time() - cpu), steps / (time.perf_counter() - wall)


class Tumble:
    def __init__(self, path, torques):
        world = tumble.World.load(path)
        self.batch, self.one, self.torques = tumble.Batch(world, WORLDS), tumble.Batch(world, 1, threads=1), torques
        # degrees of freedom of the floating root are not driven; rigid bodies beside the robot have none
        self.controls = np.zeros((WORLDS, self.batch.dof))
        self.deepest = 0.0

    def step_one(self):
        self.one.reset()
        for row in self.torques:
            self.controls[0, -row.shape[1] :] = row[0]
            self.one.step(self.controls[0])

    def step_many(self):
        self.batch.reset()
        for row in self.torques:
            self.controls[:, -row.shape[1] :] = row
            self.batch.step(self.controls)

    def overlap(self):
        """The largest depth between robot and ground after a step of one world, mm, in the second half of the run."""
        world, deepest = self.one.world(0), 0.0
        self.one.reset()
        for k, row in enumerate(self.torques):
            self.controls[0, -row.shape[1] :] = row[0]
            self.one.step(self.controls[0])
            for robot, ground in pairs(world) if 2 * k >= STEPS else ():
                found = world.closest_points(robot, ground)
                deepest = max(deepest, -float(found["distance"]) if found is not None else 0.0)
        return 1e3 * deepest


def pairs(world):
    """The robot and each static body."""
    robots = [body for body in world.bodies if isinstance(body, tumble.Articulation)]
    fixed = [body for body in world.bodies if isinstance(body, tumble.RigidBody) and body.mode == "static" and body.collidable]
    return [(robot, body) for robot in robots for body in fixed]


class Mujoco:
    def __init__(self, path, torques):
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data, self.torques = mujoco.MjData(self.model), torques
        self.start = np.zeros(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(self.model, self.data, self.start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        self.many = [mujoco.MjData(self.model) for _ in range(2)]
        self.controls = np.zeros((WORLDS, len(torques), self.model.nv))
        self.controls[:, :, -torques.shape[2] :] = torques.transpose(1, 0, 2)

    def step_one(self):
        mujoco.mj_resetData(self.model, self.data)
        for row in self.torques:
            self.data.qfrc_applied[-row.shape[1] :] = row[0]
            mujoco.mj_step(self.model, self.data)

    def step_many(self):
        self.pool.rollout([self.model] * WORLDS, self.many, np.tile(self.start, (WORLDS, 1)), self.controls, control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED))

    def overlap(self):
        """The largest depth of a contact after a step of one world, mm, in the second half of the run."""
        deepest = 0.0
        mujoco.mj_resetData(self.model, self.data)
        for k, row in enumerate(self.torques):
            self.data.qfrc_applied[-row.shape[1] :] = row[0]
            mujoco.mj_step(self.model, self.data)
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_collision(self.model, self.data)
            deepest = max([deepest, *(-contact.dist for contact in self.data.contact if 2 * k >= STEPS)])
        return 1e3 * deepest


def main():
    asked = [sys.argv[1]] if len(sys.argv) > 1 else list(MODELS)
    if mujoco is None:
        print("SKIPPED: the columns of MuJoCo, which is not installed; `make references` installs it")
    print(f"{'':14}{'':>4}{'one world, 1000 steps/s of a core':>40}{f'{WORLDS} worlds':>34}{'deepest overlap, mm':>24}")
    print(f"{'':14}{'dof':>4}{'tumble':>16}{'MuJoCo':>12}{'ratio':>12}{'tumble':>12}{'MuJoCo':>12}{'ratio':>10}{'tumble':>14}{'MuJoCo':>10}")
    for name in asked:
        path, root = MODELS[name]
        world = tumble.World.load(path)
        robot = next(body for body in world.bodies if isinstance(body, tumble.Articulation))
        torques = np.random.default_rng(0).normal(0, 0.05 * robot.mass, (STEPS, WORLDS, robot.dof - root))
        ours, theirs = Tumble(path, torques), Mujoco(path, torques) if mujoco else None
        engines = [engine for engine in (ours, theirs) if engine]
        with mujoco.rollout.Rollout(nthread=2) if mujoco else open("/dev/null") as pool:
            if theirs:
                theirs.pool = pool
            rates = {(engine, way): [] for engine in engines for way in ("step_one", "step_many")}
            for _ in range(TURNS):
                for engine, way in rates:
                    count = STEPS * (WORLDS if way == "step_many" else 1)
                    rates[engine, way].append(rate(getattr(engine, way), count)[0])
        found = {key: median(values) / 1e3 for key, values in rates.items()}
        cells = [f"{name:14}{robot.dof:4}"]
        for way, widths in (("step_one", (16, 12, 12)), ("step_many", (12, 12, 10))):
            own, other = found[ours, way], found.get((theirs, way))
            ratios = [f"{a / b:.2f}" for a, b in zip(rates[ours, way], rates[theirs, way])] if other else []
            cells += [f"{own:{widths[0]}.1f}", f"{other:{widths[1]}.1f}" if other else " " * widths[1]]
            cells += [f"{median(map(float, ratios)):{widths[2]}.2f}" if ratios else " " * widths[2]]
        cells += [f"{ours.overlap():14.4f}", f"{theirs.overlap():10.4f}" if theirs else ""]
        print("".join(cells), flush=True)


main()
