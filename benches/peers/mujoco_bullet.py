#!/usr/bin/env python3
"""Piles, towers and walls of the benchmark `piles` in MuJoCo, Bullet and tumble's Python module.

Needs Python 3.10 or newer and the wheels `mujoco`, `pybullet` and `numpy`:

    python3 -m venv target/py-peers
    target/py-peers/bin/pip install mujoco pybullet numpy
    target/py-peers/bin/pip install ../..          # tumble's module, from this folder; needs Rust
    target/py-peers/bin/python mujoco_bullet.py                       # the scenes that take seconds
    target/py-peers/bin/python mujoco_bullet.py tower-30 cubes-1e6    # some scenes
    target/py-peers/bin/python mujoco_bullet.py --engines tumble,bullet pyramid-210

An engine that is not installed is left out and named. Scenes: spheres-N, pyramid-N (55, 210, 820), tower-N,
boxes-N-eE-Rhz, cubes-R (mass ratio), masonry-10x10; the same sizes, places and random numbers as in src/scenes.rs.

CPU time is that of the process, in the calls of the step alone. Overlap and movement come from the poses, by one code for
all engines.
"""

import argparse
import re
import time
from dataclasses import dataclass

import numpy as np

DENSITY = 1000.0
GRAVITY = 9.81
SAMPLES = 60  # measurements of the errors per second
PARALLEL = 1e-6  # cross products of edges shorter than this are of parallel edges
PAIRS = 100_000  # pairs of boxes in one numpy call

FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


@dataclass
class Scene:
    """Bodies parallel to the axes at rest. `sizes`: (n, 3) edges of boxes, or (n, 1) radii of spheres, m."""

    name: str
    sizes: np.ndarray
    centers: np.ndarray
    masses: np.ndarray
    planes: list
    friction: float = 0.5
    restitution: float = 0.0
    rate: int = 60
    measured: tuple = (1.0, 4.0)
    stands: bool = True

    @property
    def spheres(self):
        return self.sizes.shape[1] == 1


# --- scenes ---------------------------------------------------------------------------------------


class Random:
    """splitmix64, as in src/random.rs."""

    def __init__(self, seed):
        self.state = seed

    def within(self, bound):
        mask = (1 << 64) - 1
        self.state = (self.state + 0x9E3779B97F4A7C15) & mask
        x = self.state
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & mask
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
        x ^= x >> 31
        return bound * (2.0 * (x >> 11) / (1 << 53) - 1.0)


def scene(name, sizes, centers, densities=DENSITY, **settings):
    sizes, centers = np.array(sizes, float), np.array(centers, float)
    volumes = 4 / 3 * np.pi * sizes[:, 0] ** 3 if sizes.shape[1] == 1 else sizes.prod(axis=1)
    return Scene(name, sizes, centers, volumes * densities, settings.pop("planes", [FLOOR]), **settings)


def walled(half):
    walls = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
    return [FLOOR] + [(tuple(-half * x for x in normal), normal) for normal in walls]


def spheres(n):
    side = next(s for s in range(1, n + 1) if s**3 >= n)
    half, random = 0.12 * side, Random(n)
    centers = []
    for i in range(n):
        x, y, z = i % side, i // side % side, i // side**2
        x, y = (0.24 * (k + 0.5) - half + random.within(0.015) for k in (x, y))
        centers.append((x, y, 0.12 + 0.24 * z))
    return scene(f"spheres-{n}", [[0.1]] * n, centers, planes=walled(half), stands=False)


def pyramid(n):
    rows = next(r for r in range(1, n + 1) if r * (r + 1) // 2 >= n)
    centers = [
        ((i - 0.5 * (rows - k - 1)) * 0.42, 0.0, 0.4 * (k + 0.5)) for k in range(rows) for i in range(rows - k)
    ]
    return scene(f"pyramid-{len(centers)}", [[0.4] * 3] * len(centers), centers)


def tower(n):
    centers = [(0.0, 0.0, 0.4 * (i + 0.5)) for i in range(n)]
    return scene(f"tower-{n}", [[0.4] * 3] * n, centers, measured=(0.0, 10.0))


def boxes(n, restitution, rate):
    side = round(np.cbrt(n / 3))
    half, random = 0.15 * side, Random(n)
    sizes, centers = [], []
    for i in range(n):
        sizes.append([0.14 + random.within(0.06) for _ in range(3)])
        x, y = (0.3 * (k + 0.5) - half + random.within(0.04) for k in (i % side, i // side % side))
        centers.append((x, y, 0.2 + 0.3 * (i // side**2)))
    name = f"boxes-{n}-e{restitution:g}-{rate}hz"
    settings = dict(restitution=restitution, rate=rate, measured=(0.0, 4.0), stands=False)
    return scene(name, sizes, centers, planes=walled(half), **settings)


def cubes(ratio):
    edge, masses = 0.2, np.array([1e-3, 1e-3 * ratio])
    centers = [(0.0, 0.0, edge * (i + 0.5)) for i in range(2)]
    name = f"cubes-1e{round(np.log10(ratio))}"
    return scene(name, [[edge] * 3] * 2, centers, masses / edge**3, friction=0.9, measured=(0.0, 10.0))


def masonry():
    length, width, height, joint = 0.25, 0.12, 0.065, 0.002
    sizes, centers = [], []
    for row in range(10):
        z = height * (row + 0.5)
        middles = [i + 0.5 for i in range(10)] if row % 2 == 0 else list(range(1, 10))
        sizes += [[length, width, height]] * len(middles)
        centers += [(i * (length + joint), 0.0, z) for i in middles]
        if row % 2:
            half = 0.5 * (length - joint)
            ends = [0.5 * joint + 0.5 * half, 10 * (length + joint) - 0.5 * joint - 0.5 * half]
            sizes += [[half, width, height]] * 2
            centers += [(x, 0.0, z) for x in ends]
    return scene("masonry-10x10", sizes, centers, measured=(0.0, 10.0))


def named(name):
    """Returns the scene of a name."""
    kinds = {
        r"spheres-(\d+)": lambda n: spheres(int(n)),
        r"pyramid-(\d+)": lambda n: pyramid(int(n)),
        r"tower-(\d+)": lambda n: tower(int(n)),
        r"boxes-(\d+)-e([\d.]+)-(\d+)hz": lambda n, e, rate: boxes(int(n), float(e), int(rate)),
        r"cubes-(1e\d+)": lambda ratio: cubes(float(ratio)),
        r"masonry-10x10": masonry,
    }
    for pattern, make in kinds.items():
        if match := re.fullmatch(pattern, name):
            return make(*match.groups())
    raise SystemExit(f"no scene is called {name}")


DEFAULT = (
    "spheres-100 pyramid-55 pyramid-210 tower-10 tower-30 tower-100 boxes-200-e0-60hz "
    "boxes-200-e0-240hz boxes-200-e0.2-240hz cubes-1e6 cubes-1e9 masonry-10x10"
)


# --- engines --------------------------------------------------------------------------------------
# An engine has `step()`, one frame, and `poses()`: centers (n, 3) and rotation matrices (n, 3, 3).


class MuJoCo:
    """MuJoCo: defaults, with a number of steps per frame. It has no restitution."""

    def __init__(self, scene, steps=1):
        import mujoco

        self.mujoco, self.steps = mujoco, steps
        friction = f"{scene.friction} 0.005 0.0001"
        lines = []
        for point, normal in scene.planes:
            place = " ".join(map(str, point))
            axis = " ".join(map(str, normal))
            lines.append(f'<geom type="plane" size="0 0 1" pos="{place}" zaxis="{axis}" friction="{friction}"/>')
        for size, center, mass in zip(scene.sizes, scene.centers, scene.masses):
            kind = "sphere" if scene.spheres else "box"
            size = size if scene.spheres else 0.5 * size
            numbers = " ".join(f"{x:.17g}" for x in size)
            place = " ".join(f"{x:.17g}" for x in center)
            geom = f'<geom type="{kind}" size="{numbers}" mass="{mass:.17g}" friction="{friction}"/>'
            lines.append(f'<body pos="{place}"><freejoint/>{geom}</body>')
        option = f'<option timestep="{1 / (scene.rate * steps):.17g}" gravity="0 0 {-GRAVITY}"/>'
        xml = f'<mujoco>{option}<size memory="1G"/><worldbody>{"".join(lines)}</worldbody></mujoco>'
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)

    def step(self):
        self.mujoco.mj_step(self.model, self.data, self.steps)

    def poses(self):
        # positions of the last step; xpos and xmat are those before it
        self.mujoco.mj_kinematics(self.model, self.data)
        return self.data.xpos[1:].copy(), self.data.xmat[1:].reshape(-1, 3, 3).copy()


class Bullet:
    """Bullet: defaults without damping and sleep, with a number of steps per frame."""

    def __init__(self, scene, steps=1):
        import pybullet
        from pybullet_utils.bullet_client import BulletClient

        self.steps = steps
        self.client = client = BulletClient(connection_mode=pybullet.DIRECT)
        client.setGravity(0, 0, -GRAVITY)
        client.setTimeStep(1 / (scene.rate * steps))
        # coefficients of a pair are products
        surface = dict(lateralFriction=scene.friction**0.5, restitution=scene.restitution**0.5)
        surface |= dict(linearDamping=0, angularDamping=0, rollingFriction=0, spinningFriction=0)
        for point, normal in scene.planes:
            shape = client.createCollisionShape(pybullet.GEOM_PLANE, planeNormal=normal)
            body = client.createMultiBody(0, shape, basePosition=point)
            client.changeDynamics(body, -1, **surface)
        self.bodies = []
        for size, center, mass in zip(scene.sizes, scene.centers, scene.masses):
            if scene.spheres:
                shape = client.createCollisionShape(pybullet.GEOM_SPHERE, radius=size[0])
            else:
                shape = client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=0.5 * size)
            body = client.createMultiBody(mass, shape, basePosition=center, useMaximalCoordinates=True)
            client.changeDynamics(body, -1, **surface)
            self.bodies.append(body)

    def step(self):
        for _ in range(self.steps):
            self.client.stepSimulation()

    def poses(self):
        poses = [self.client.getBasePositionAndOrientation(body) for body in self.bodies]
        centers = np.array([center for center, _ in poses])
        return centers, matrices(np.array([turn for _, turn in poses]))


class Tumble:
    """tumble: defaults."""

    def __init__(self, scene):
        import tumble

        self.world = world = tumble.World(gravity=(0, 0, -GRAVITY), dt=1 / scene.rate)
        surface = dict(friction=scene.friction, restitution=scene.restitution)
        for point, normal in scene.planes:
            plane = tumble.HalfSpace(normal, float(np.dot(point, normal)))
            world.add_static(plane, **surface)
        self.bodies = []
        for size, center, mass in zip(scene.sizes, scene.centers, scene.masses):
            shape = tumble.Sphere(size[0]) if scene.spheres else tumble.Box(size)
            self.bodies.append(world.add_rigid(shape, mass=mass, position=center, **surface))

    def step(self):
        self.world.step()

    def poses(self):
        centers = np.array([body.position for body in self.bodies])
        return centers, matrices(np.array([body.orientation for body in self.bodies]))


def matrices(turns):
    """Returns the rotation matrices (n, 3, 3) of unit quaternions (n, 4), x y z w."""
    x, y, z, w = turns.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


ENGINES = {
    "tumble": Tumble,
    "mujoco": MuJoCo,
    "mujoco8": lambda scene: MuJoCo(scene, max(1, round(480 / scene.rate))),
    "bullet": Bullet,
    "bullet4": lambda scene: Bullet(scene, max(1, round(240 / scene.rate))),
}
TITLES = {
    "tumble": "tumble",
    "mujoco": "MuJoCo",
    "mujoco8": "MuJoCo at 480 Hz",
    "bullet": "Bullet",
    "bullet4": "Bullet at 240 Hz",
}


# --- measure --------------------------------------------------------------------------------------


def deepest(scene, centers, turns):
    """Returns the largest depth of two bodies, or of a body in a plane, m; 0 if nothing overlaps."""
    halves = np.zeros((len(centers), 3, 3)) if scene.spheres else turns * 0.5 * scene.sizes[:, None, :]
    radii = scene.sizes[:, 0] if scene.spheres else np.zeros(len(centers))
    worst = 0.0
    for point, normal in scene.planes:
        extents = radii + np.abs(np.einsum("nij,i->nj", halves, normal)).sum(axis=1)
        worst = max(worst, (extents - (centers - point) @ np.array(normal)).max())
    bounds = radii if scene.spheres else 0.5 * np.linalg.norm(scene.sizes, axis=1)
    first, second = near(centers, bounds)
    if scene.spheres:
        depths = radii[first] + radii[second] - np.linalg.norm(centers[second] - centers[first], axis=1)
        return max(worst, depths.max(initial=0.0))
    for start in range(0, len(first), PAIRS):
        a, b = first[start : start + PAIRS], second[start : start + PAIRS]
        worst = max(worst, box_depths(centers, turns, halves, a, b).max(initial=0.0))
    return worst


def near(centers, bounds):
    """Returns the pairs of bodies whose bounding spheres overlap, as two arrays of indices."""
    first, second = [], []
    for i in range(len(centers) - 1):
        away = np.linalg.norm(centers[i + 1 :] - centers[i], axis=1)
        found = np.flatnonzero(away < bounds[i + 1 :] + bounds[i]) + i + 1
        first.append(np.full(len(found), i))
        second.append(found)
    empty = np.zeros(0, int)
    return np.concatenate([empty, *first]), np.concatenate([empty, *second])


def box_depths(centers, turns, halves, a, b):
    """Returns the shortest way that parts each pair of boxes, m: along a face normal or a cross product of edges."""
    edges = np.cross(turns[a].transpose(0, 2, 1)[:, :, None], turns[b].transpose(0, 2, 1)[:, None], axis=3)
    edges = edges.reshape(-1, 9, 3)
    lengths = np.linalg.norm(edges, axis=2, keepdims=True)
    parallel = lengths < PARALLEL
    edges = edges / np.where(parallel, 1.0, lengths)
    axes = np.concatenate([turns[a].transpose(0, 2, 1), turns[b].transpose(0, 2, 1), edges], axis=1)
    extents = sum(np.abs(axes @ halves[body]).sum(axis=2) for body in (a, b))
    depths = extents - np.abs(np.einsum("nij,nj->ni", axes, centers[b] - centers[a]))
    depths[:, 6:][parallel[:, :, 0]] = np.inf
    return depths.min(axis=1)


@dataclass
class Run:
    cpu: float = 0.0
    overlap: float = 0.0
    overlap_at_end: float = 0.0
    movement: float = 0.0


def run(engine, scene):
    """Steps an engine through the whole time. Returns CPU s per simulated s, overlap and movement, m."""
    first, last = (round(t * scene.rate) for t in scene.measured)
    result = Run()
    for frame in range(1, last + 1):
        before = time.process_time()
        engine.step()
        spent = time.process_time() - before
        if frame <= first:
            continue
        result.cpu += spent
        if frame % (scene.rate // SAMPLES) == 0:
            centers, turns = engine.poses()
            result.overlap_at_end = deepest(scene, centers, turns)
            result.overlap = max(result.overlap, result.overlap_at_end)
            moved = np.linalg.norm(centers - scene.centers, axis=1).max()
            result.movement = max(result.movement, moved)
    result.cpu /= scene.measured[1] - scene.measured[0]
    return result


def installed(name):
    """Returns whether an engine can be loaded, and prints a line if not."""
    try:
        ENGINES[name](tower(1))
    except ImportError as error:
        print(f"{TITLES[name]} is left out: {error}")
        return False
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="*", default=DEFAULT.split())
    parser.add_argument("--engines", default=",".join(ENGINES), help="names, separated by commas")
    arguments = parser.parse_args()
    scenes = [named(name) for name in arguments.scenes]
    engines = [name for name in arguments.engines.split(",") if installed(name)]
    print("CPU s per simulated s (ratio to the first engine); overlap, at the end, movement in mm.")
    print("| case | " + " | ".join(TITLES[name] for name in engines) + " | overlap | at the end | movement |")
    print("|---" * (len(engines) + 4) + "|")
    for scene in scenes:
        runs = [run(ENGINES[name](scene), scene) for name in engines]
        cpu = [f"{r.cpu:.4f}" + (f" ({r.cpu / runs[0].cpu:.2f})" if i else "") for i, r in enumerate(runs)]
        cell = lambda figure: ", ".join(f"{1e3 * figure(r):.3f}" for r in runs)
        moved = cell(lambda r: r.movement) if scene.stands else "–"
        cells = [*cpu, cell(lambda r: r.overlap), cell(lambda r: r.overlap_at_end), moved]
        print(f"| {scene.name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
