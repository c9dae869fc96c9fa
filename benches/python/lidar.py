"""A lidar of 100,000 rays on 1,000 bodies and a mesh of 71,680 triangles: tumble, parry and MuJoCo in one run, each on one thread.

    make references                                                           # installs MuJoCo once
    scripts/test_python.sh crates/py/tests/test_package.py                    # installs tumble beside it
    target/py-tests/bin/python benches/python/lidar.py

The bench `rays` of benches/peers makes the scene and measures tumble from Rust and parry. Here the same scene is measured from Python, in tumble and
with `mj_multiRay`. All engines find the distances that the bench wrote; medians of nine scans, CPU time. The boxes of the bodies are built anew for each scan in
tumble and in parry, as in MuJoCo, whose tree of static bodies is kept.
"""

import subprocess
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np

import tumble

ORIGIN, SCANS = (0.0, 0.0, 2.0), 9
PEERS = Path(__file__).parents[1] / "peers"


def median(scan) -> tuple[float, np.ndarray]:
    """CPU time of a scan, s, and its distances."""
    times = []
    for _ in range(SCANS):
        start = time.process_time()
        distances = scan()
        times.append(time.process_time() - start)
    return float(np.median(times)), distances


def tumble_scan(bodies, vertices, triangles, directions):
    world = tumble.World()
    for kind, a, b, c, *pose in bodies:
        shape = [lambda: tumble.Sphere(a), lambda: tumble.Box((2 * a, 2 * b, 2 * c)), lambda: tumble.Capsule(a, 2 * b), lambda: tumble.Mesh(vertices, triangles)][int(kind)]()
        world.add_static(shape, position=pose[:3], orientation=pose[3:])
    return lambda: world.cast_rays(ORIGIN, directions, 100.0)["distance"]


def mujoco_scan(bodies, vertices, triangles, directions):
    spec = mujoco.MjSpec()
    spec.add_mesh(name="statue", uservert=vertices.ravel(), userface=triangles.astype(np.int32).ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    kinds = [mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_MESH]
    for kind, a, b, c, *pose in bodies:
        x, y, z, qx, qy, qz, qw = pose
        body = spec.worldbody.add_body(pos=(x, y, z), quat=(qw, qx, qy, qz))
        geom = body.add_geom(type=kinds[int(kind)], size=(a, b, c))
        if kind == 3:
            geom.meshname = "statue"
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    n = len(directions)
    geoms, distances, flat, origin = np.zeros(n, np.int32), np.zeros(n), directions.ravel().copy(), np.array(ORIGIN)

    def scan():
        mujoco.mj_multiRay(model, data, origin, flat, None, True, -1, geoms, distances, None, n, 100.0)
        return np.where(geoms < 0, np.inf, distances)

    return scan


with tempfile.TemporaryDirectory() as folder:
    command = ["cargo", "bench", "--quiet", "--locked", "--bench", "rays", "--", "--write", folder]
    print(subprocess.run(command, cwd=PEERS, check=True, capture_output=True, text=True).stdout, end="")
    bodies, vertices, triangles, directions, wanted = (np.loadtxt(f"{folder}/{name}.txt") for name in ("bodies", "vertices", "triangles", "directions", "distances"))
wanted = np.where(wanted < 0, np.inf, wanted)
results = {}
for name, build in {"tumble from Python": tumble_scan, "mj_multiRay": mujoco_scan}.items():
    results[name], distances = median(build(bodies, vertices, triangles, directions))
    with np.errstate(invalid="ignore"):
        differ = int(((np.abs(distances - wanted) > 1e-5) & (distances != wanted)).sum())
    print(f"{name}: {1e3 * results[name]:.1f} ms of CPU per scan; {differ} of {len(wanted)} rays differ by more than 1e-5 m")
ours, theirs = results.values()
print(f"MuJoCo takes {theirs / ours:.2f} times as long as tumble from Python")
