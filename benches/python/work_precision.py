"""Error over CPU time on six problems with known answers: both steppers of tumble, MuJoCo and Rapier, at time steps from 1/30 to 1/1920 s.

    make work-precision                                               # installs MuJoCo and builds Rapier once; draws docs/images/work_precision.svg

Arguments: the picture, and a file with the output of `cargo bench --bench precision` in benches/peers, for Rapier. tumble and MuJoCo read the same model. A point is
one run: the CPU time of a simulated second, and the error at its end. MuJoCo has elliptic friction cones, because the answers are those of Coulomb's law, and
otherwise its defaults; its contacts are soft by design. `docs/work_precision.md` has the problems.
"""

import sys
import tempfile
import time
from math import cos, hypot, pi, radians, sin
from pathlib import Path

import numpy as np

import tumble

try:
    import mujoco
except ImportError:
    mujoco = None

G = 9.81
RATES = (30, 60, 120, 240, 480, 960, 1920)
# seconds of processor time for one measured point, at least
LEAST = 0.1
COLORS = {
    "tumble, time_stepping": "#1f6fb4",
    "tumble, backtracking": "#0a9e73",
    "tumble, dormand_prince": "#7a4fb0",
    "MuJoCo, Euler": "#d1741a",
    "MuJoCo, RK4": "#b8263b",
    "Rapier": "#6b6b6b",
}
TUMBLE = {
    "tumble, time_stepping": ("time_stepping", "verlet"),
    "tumble, backtracking": ("backtracking", "verlet"),
    "tumble, dormand_prince": ("backtracking", "dormand_prince"),
}
MUJOCO = {"MuJoCo, Euler": "Euler", "MuJoCo, RK4": "RK4"}


def rk4(f, y, end, steps):
    """The solution of y' = f(y) at a time, by a number of steps of the classical method."""
    h = end / steps
    for _ in range(steps):
        a = f(y)
        b = f(y + 0.5 * h * a)
        c = f(y + 0.5 * h * b)
        d = f(y + h * c)
        y = y + h / 6 * (a + 2 * b + 2 * c + d)
    return y


class Tumbling:
    """A free body with three different moments of inertia turns without gravity; error: angle to the solution of Euler's equations, rad."""

    title, unit, end = "free body that tumbles", "rad", 2.0
    inertia, spin = np.array([0.02, 0.03, 0.045]), np.array([3.0, 4.0, 2.0])
    gravity = (0, 0, 0)
    # a box with these moments: edges √0.33, √0.21 and √0.03 m
    model = f"""<body name="body"><freejoint/>
        <geom type="box" size="{0.33**0.5 / 2!r} {0.21**0.5 / 2!r} {0.03**0.5 / 2!r}" mass="1"/></body>"""

    def answer(self):
        def rate(y):
            q, w = y[:4], y[4:]
            turn = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
            return np.concatenate([turn, -np.cross(w, self.inertia * w) / self.inertia])

        return rk4(rate, np.array([1.0, 0, 0, 0, *self.spin]), self.end, 4000)[:4]

    def start_tumble(self, world):
        world.body("body").angular_velocity = self.spin

    def start_mujoco(self, data):
        data.qvel[3:6] = self.spin

    def error(self, q, answer):
        """The quaternions are (w, x, y, z)."""
        q = q / np.linalg.norm(q)
        return 2 * np.linalg.norm(q - np.copysign(1.0, q @ answer) * answer)

    def of_tumble(self, world):
        return np.roll(world.body("body").orientation, 1)  # (x, y, z, w) there

    def of_mujoco(self, data):
        return data.qpos[3:7]

    def of_rapier(self, values):
        return values


class DoublePendulum:
    """Two rods of 1 m and 1 kg, let go at 90 and 40 degrees; error: angles against the equations of Lagrange, rad."""

    title, unit, end = "double pendulum", "rad", 3.0
    gravity = (0, 0, -G)
    first, second = radians(90), radians(40)
    rod = '<inertial pos="0 0 -0.5" mass="1" diaginertia="0.08333333333333333 0.08333333333333333 0.001"/>'
    model = f"""<body name="upper" pos="0 0 3"><joint name="a" axis="0 1 0"/>{rod}
        <body name="lower" pos="0 0 -1"><joint name="b" axis="0 1 0"/>{rod}</body></body>"""

    def answer(self):
        third = 1 / 3

        def rate(y):
            a, b, va, vb = y
            c, s = 0.5 * cos(a - b), 0.5 * sin(a - b)
            mass = np.array([[third + 1, c], [c, third]])
            force = np.array([-s * vb * vb - 1.5 * G * sin(a), s * va * va - 0.5 * G * sin(b)])
            return np.array([va, vb, *np.linalg.solve(mass, force)])

        a, b, _, _ = rk4(rate, np.array([self.first, self.second, 0.0, 0.0]), self.end, 6000)
        return np.array([a, b - a])

    def start_tumble(self, world):
        world.articulation("upper").q = [self.first, self.second - self.first]

    def start_mujoco(self, data):
        data.qpos[:] = [self.first, self.second - self.first]

    def error(self, q, answer):
        # angles of Rapier are those of directions
        return hypot(*(np.remainder(q - answer + pi, 2 * pi) - pi))

    def of_tumble(self, world):
        return np.asarray(world.articulation("upper").q)

    def of_mujoco(self, data):
        return data.qpos

    def of_rapier(self, values):
        return values


class Moved:
    """A single body on a plane; error: its position along x, m."""

    unit = "m"
    gravity = (0, 0, -G)
    speed = 0.0

    def start_tumble(self, world):
        world.body("body").velocity = (self.speed, 0, 0)

    def start_mujoco(self, data):
        data.qvel[0] = self.speed

    def error(self, x, answer):
        return abs(x - answer)

    def of_tumble(self, world):
        return world.body("body").position[0]

    def of_mujoco(self, data):
        return data.qpos[0]

    def of_rapier(self, values):
        return values[0]


def on_plane(shape, z, friction):
    return f"""<geom type="plane" size="50 50 1" friction="{friction} 0 0"/><body name="body" pos="0 0 {z}"><freejoint/>
        <geom {shape} mass="1" friction="{friction} 0 0"/></body>"""


class Sliding(Moved):
    """A box slides to rest: v²/(2μg)."""

    title, end, speed = "box that slides to rest", 1.0, 2.0
    model = on_plane('type="box" size="0.1 0.1 0.1"', 0.1, 0.5)

    def answer(self):
        return self.speed**2 / (2 * 0.5 * G)


class Struck(Moved):
    """A ball slides until it rolls: at 5/7 of its speed, after 2v/(7μg)."""

    title, end, speed = "ball that slides, then rolls", 2.0, 3.0
    model = on_plane('type="sphere" size="0.1"', 0.1, 0.2)

    def answer(self):
        slides = 2 * self.speed / (7 * 0.2 * G)
        return self.speed * slides - 0.1 * G * slides**2 + 5 / 7 * self.speed * (self.end - slides)


class Slope(Moved):
    """A ball rolls down a slope of 20 degrees: ½·5/7·g·sin α·t²."""

    title, end = "ball that rolls down a slope", 2.0
    gravity = (G * sin(radians(20)), 0, -G * cos(radians(20)))
    model = on_plane('type="sphere" size="0.1"', 0.1, 0.5)

    def answer(self):
        return 0.5 * 5 / 7 * G * sin(radians(20)) * self.end**2


class Tower:
    """Ten cubes stand on each other; error: how far one of them has moved, m."""

    title, unit, end = "tower of ten cubes", "m", 2.0
    gravity = (0, 0, -G)
    model = '<geom type="plane" size="50 50 1" friction="0.5 0 0"/>' + "".join(
        f'<body name="cube{i}" pos="0 0 {0.1 + 0.2 * i}"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1" friction="0.5 0 0"/></body>'
        for i in range(10)
    )

    def answer(self):
        return np.array([[0, 0, 0.1 + 0.2 * i] for i in range(10)])

    def start_tumble(self, world):
        pass

    def start_mujoco(self, data):
        pass

    def error(self, x, answer):
        return float(np.max(np.linalg.norm(x - answer, axis=1)))

    def of_tumble(self, world):
        return np.array([world.body(f"cube{i}").position for i in range(10)])

    def of_mujoco(self, data):
        return data.qpos.reshape(10, 7)[:, :3]

    def of_rapier(self, values):
        return values.reshape(10, 3)


PROBLEMS = (Tumbling(), DoublePendulum(), Sliding(), Struck(), Slope(), Tower())


def text_of(problem, rate, integrator):
    gravity = " ".join(map(repr, problem.gravity))
    return f"""<mujoco><option timestep="{1 / rate!r}" gravity="{gravity}" integrator="{integrator}" cone="elliptic"/>
        <worldbody>{problem.model}</worldbody></mujoco>"""


def run(start, step, problem, rate):
    """Processor time of a simulated second, and the value that ``step`` returns after the last."""
    spent, times = 0.0, 0
    while spent < LEAST:
        world = start()
        before = time.process_time()
        value = step(world, round(problem.end * rate))
        spent, times = spent + time.process_time() - before, times + 1
    return spent / (times * problem.end), value


def point_of_tumble(problem, rate, stepper, integrator, folder):
    path = folder / "model.xml"
    path.write_text(text_of(problem, rate, "Euler"))

    def start():
        world = tumble.World.load(path, dt=1 / rate, stepper=stepper, integrator=integrator)
        problem.start_tumble(world)
        return world

    def step(world, steps):
        world.step(steps)
        return problem.of_tumble(world)

    return run(start, step, problem, rate)


def point_of_mujoco(problem, rate, integrator):
    model = mujoco.MjModel.from_xml_string(text_of(problem, rate, integrator))

    def start():
        data = mujoco.MjData(model)
        problem.start_mujoco(data)
        return data

    def step(data, steps):
        mujoco.mj_step(model, data, steps)
        return np.array(problem.of_mujoco(data))

    return run(start, step, problem, rate)


def points_of_rapier(path):
    """For each problem its points: processor time of a simulated second, and values at the end."""
    points = {problem.title: [] for problem in PROBLEMS}
    for line in Path(path).read_text().splitlines():
        title, _, seconds, values = line.split("\t")
        points[title].append((float(seconds), np.array(values.split(), dtype=float)))
    return points


def measure(rapier):
    """For each problem the curve of each program: pairs of processor time and error."""
    curves = {}
    with tempfile.TemporaryDirectory() as folder:
        for problem in PROBLEMS:
            answer = problem.answer()
            own = curves.setdefault(problem.title, {})
            for name, (stepper, integrator) in TUMBLE.items():
                points = [point_of_tumble(problem, rate, stepper, integrator, Path(folder)) for rate in RATES]
                own[name] = [(t, problem.error(value, answer)) for t, value in points]
            for name, integrator in MUJOCO.items() if mujoco else ():
                points = [point_of_mujoco(problem, rate, integrator) for rate in RATES]
                own[name] = [(t, problem.error(value, answer)) for t, value in points]
            if rapier:
                points = rapier[problem.title]
                own["Rapier"] = [(t, problem.error(problem.of_rapier(value), answer)) for t, value in points]
            report(problem, own)
    return curves


def report(problem, curves):
    print(f"\n{problem.title}: error, {problem.unit} (CPU ms of a simulated second)", flush=True)
    print(f"{'':42}" + "".join(f"{f'1/{rate}':>18}" for rate in RATES))
    for name, points in curves.items():
        print(f"{name:42}" + "".join(f"{error:>9.1e} ({1e3 * t:>6.2f})" for t, error in points), flush=True)


# Chart: panels of equal axes, error over processor time, both logarithmic.
COLUMNS, PANEL, GAP, LEFT, TOP, BOTTOM = 3, (270, 210), (52, 50), 62, 40, 66
TIMES, ERRORS = (-5, 0), (-15, 1)


def place(corner, point):
    share = [
        (np.log10(np.clip(value, 10.0**low, 10.0**high)) - low) / (high - low)
        for value, (low, high) in zip(point, (TIMES, ERRORS), strict=True)
    ]
    return corner[0] + share[0] * PANEL[0], corner[1] + (1 - share[1]) * PANEL[1]


def text(x, y, words, anchor="middle", color="#555", more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{color}"{more}>{words}</text>'


def panel(corner, problem, curves):
    left, top = corner
    out = [text(left, top - 8, f"{problem.title}, {problem.unit}", "start", "#000")]
    for power in range(TIMES[0], TIMES[1] + 1):
        x, _ = place(corner, (10.0**power, 1))
        out.append(f'<path d="M{x:.1f} {top}v{PANEL[1]}" stroke="#e4e4e4"/>')
        out.append(text(x, top + PANEL[1] + 14, f"1e{power}"))
    for power in range(ERRORS[0], ERRORS[1] + 1, 4):
        _, y = place(corner, (1, 10.0**power))
        out.append(f'<path d="M{left} {y:.1f}h{PANEL[0]}" stroke="#e4e4e4"/>')
        out.append(text(left - 5, y + 4, f"1e{power}", "end"))
    for name, points in curves.items():
        at = [place(corner, point) for point in points]
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in at)
        out.append(f'<path d="M{path}" fill="none" stroke="{COLORS[name]}" stroke-width="1.5"/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.6" fill="{COLORS[name]}"/>' for x, y in at]
    return out


def chart(curves):
    rows = -(-len(PROBLEMS) // COLUMNS)
    width, height = LEFT + COLUMNS * (PANEL[0] + GAP[0]), TOP + rows * (PANEL[1] + GAP[1]) + BOTTOM - GAP[1] + 20
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">']
    out.append('<rect width="100%" height="100%" fill="white"/>')
    for i, problem in enumerate(PROBLEMS):
        corner = LEFT + i % COLUMNS * (PANEL[0] + GAP[0]), TOP + i // COLUMNS * (PANEL[1] + GAP[1])
        out += panel(corner, problem, curves[problem.title])
    out.append(text(width / 2, height - 38, "CPU time of a simulated second, s", color="#000"))
    x = LEFT
    for name, color in COLORS.items():
        out.append(f'<path d="M{x} {height - 16}h22" stroke="{color}" stroke-width="2"/>')
        out.append(text(x + 28, height - 12, name, "start", "#000"))
        x += 56 + 5.8 * len(name)
    return "\n".join([*out, "</svg>\n"])


if __name__ == "__main__":
    measured = measure(points_of_rapier(sys.argv[2]) if len(sys.argv) > 2 else None)
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(chart(measured))
