"""Dynamics of trees of links by Pinocchio, for comparison.

    pinocchio_reference.py robots       prints the trees of some robots from example-robot-data (exit 77 where a package is missing)
    pinocchio_reference.py check        reads a tree and states of it from standard input, prints what Pinocchio computes

A tree is either a line `urdf PATH fixed` or `urdf PATH floating`, which Pinocchio reads by itself, and then a line `name kind LINK` for each moving link
in tumble's order; or it is lines `link parent kind axis(3) placement(3, quaternion x y z w) mass center(3) inertia(9)`, parent -1 for a root, kind one of revolute,
prismatic, spherical, floating. A state is four lines `q`, `v`, `a`, `t` (positions, velocities, accelerations, torques) and a line `go`.
Numbers are in SI units. Conventions of the numbers are tumble's: quaternions x y z w; a floating link has position and quaternion, and velocity
[angular; linear] in world axes; a spherical joint has its angular velocity in the link's axes. Here they are turned into Pinocchio's and back.
"""

import pathlib
import sys

try:
    import numpy as np
    import pinocchio as pin
except ImportError as error:
    print(error)
    sys.exit(77)


class Tree:
    """A Pinocchio model, and where the numbers of each link lie on both sides."""

    def __init__(self, model, kinds, joint):
        self.model, self.data, self.kinds, self.joint = model, model.createData(), kinds, joint
        sizes = {"revolute": (1, 1), "prismatic": (1, 1), "spherical": (4, 3), "floating": (7, 6)}
        self.q_at = np.cumsum([0] + [sizes[kind][0] for kind in kinds])
        self.v_at = np.cumsum([0] + [sizes[kind][1] for kind in kinds])
        if self.v_at[-1] != model.nv:
            sys.exit(f"tumble has {self.v_at[-1]} degrees of freedom, Pinocchio {model.nv}")

    @staticmethod
    def read(path, base, names):
        model = pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer()) if base == "floating" else pin.buildModelFromUrdf(path)
        joints = [model.frames[model.getFrameId(name, pin.FrameType.BODY)].parentJoint for _, name in names]
        return Tree(model, [kind for kind, _ in names], joints)

    @staticmethod
    def build(lines):
        model, joint = pin.Model(), [None] * len(lines)
        parents, kinds = [int(line[0]) for line in lines], [line[1] for line in lines]
        children = {i: [k for k, p in enumerate(parents) if p == i] for i in range(-1, len(lines))}
        # Pinocchio wants each subtree in one piece: depth first.
        todo = list(reversed(children[-1]))
        while todo:
            i = todo.pop()
            at = 0 if parents[i] < 0 else joint[parents[i]]
            joint[i] = Tree.add(model, at, kinds[i], f"joint {i}", [float(x) for x in lines[i][2:]])
            todo.extend(reversed(children[i]))
        return Tree(model, kinds, joint)

    @staticmethod
    def add(model, at, kind, name, x):
        axis, shift, turn = np.array(x[:3]), np.array(x[3:6]), pin.Quaternion(np.array(x[6:10])).normalized()
        made = {
            "revolute": lambda: pin.JointModelRevoluteUnaligned(axis),
            "prismatic": lambda: pin.JointModelPrismaticUnaligned(axis),
            "spherical": pin.JointModelSpherical,
            "floating": pin.JointModelFreeFlyer,
        }[kind]()
        placement = pin.SE3.Identity() if kind == "floating" else pin.SE3(turn.matrix(), shift)
        joint = model.addJoint(at, made, placement, name)
        inertia = pin.Inertia(x[10], np.array(x[11:14]), np.array(x[14:23]).reshape(3, 3))
        model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
        return joint

    def positions(self, q):
        out = pin.neutral(self.model)
        for i, j in enumerate(self.joint):
            own = q[self.q_at[i] : self.q_at[i + 1]]
            if self.kinds[i] == "revolute" and self.model.nqs[j] == 2:  # a continuous joint
                own = [np.cos(own[0]), np.sin(own[0])]
            out[self.model.idx_qs[j] : self.model.idx_qs[j] + self.model.nqs[j]] = own
        return out

    def turner(self, q):
        """T with v_pinocchio = T v_tumble: a permutation, and for a floating link a turn into its own axes with linear first."""
        out = np.zeros((self.model.nv, self.model.nv))
        for i, j in enumerate(self.joint):
            at, ours = self.model.idx_vs[j], self.v_at[i]
            if self.kinds[i] == "floating":
                r = pin.Quaternion(np.array(q[self.q_at[i] + 3 : self.q_at[i] + 7])).normalized().matrix().T
                out[at : at + 3, ours + 3 : ours + 6] = r
                out[at + 3 : at + 6, ours : ours + 3] = r
            else:
                for k in range(self.model.nvs[j]):
                    out[at + k, ours + k] = 1.0
        return out

    def slip(self, q, v):
        """dT/dt v: what the turning of a floating link's axes adds to Pinocchio's acceleration."""
        out = np.zeros(self.model.nv)
        for i, j in enumerate(self.joint):
            if self.kinds[i] == "floating":
                at, ours = self.model.idx_vs[j], self.v_at[i]
                r = pin.Quaternion(np.array(q[self.q_at[i] + 3 : self.q_at[i] + 7])).normalized().matrix().T
                out[at : at + 3] = -r @ np.cross(v[ours : ours + 3], v[ours + 3 : ours + 6])
        return out

    def answer(self, q, v, a, tau):
        model, data = self.model, self.data
        t, slip, where = self.turner(q), self.slip(q, v), self.positions(q)
        back = np.linalg.inv(t)
        speed, rise = t @ v, t @ a + slip
        emit("qdd", back @ (pin.aba(model, data, where, speed, back.T @ tau).copy() - slip))
        emit("tau", t.T @ pin.rnea(model, data, where, speed, rise))
        mass = pin.crba(model, data, where).copy()
        mass = np.triu(mass) + np.triu(mass, 1).T
        emit("mass", (t.T @ mass @ t).ravel())
        emit("energy", [pin.computeKineticEnergy(model, data, where, speed), pin.computePotentialEnergy(model, data, where)])
        pin.centerOfMass(model, data, where, speed)
        emit("center", np.concatenate([data.com[0], data.vcom[0]]))
        h = pin.computeCentroidalMomentum(model, data, where, speed)
        emit("momentum", np.concatenate([h.linear, h.angular + np.cross(data.com[0], h.linear)]))
        pin.forwardKinematics(model, data, where, speed, rise)
        rates = [pin.getClassicalAcceleration(model, data, j, pin.LOCAL_WORLD_ALIGNED) for j in self.joint]
        emit("accelerations", np.concatenate([np.concatenate([r.angular, r.linear]) for r in rates]))
        pin.computeJointJacobians(model, data, where)
        last = pin.getJointJacobian(model, data, self.joint[-1], pin.LOCAL_WORLD_ALIGNED).reshape(6, -1) @ t
        emit("jacobian", np.vstack([last[3:], last[:3]]).ravel())


def emit(name, numbers):
    print(name, *[repr(float(x)) for x in numbers])


def check():
    lines, names, urdf, tree, state, gravity = [], [], None, None, {}, [0.0, 0.0, 0.0]
    for line in sys.stdin:
        name, *rest = line.split()
        if name == "link":
            lines.append(rest)
        elif name == "urdf":
            urdf = line.split(" ", 1)[1].strip().rsplit(" ", 1)
        elif name == "name":
            names.append(line.strip().split(" ", 2)[1:])
        elif name == "gravity":
            gravity = [float(x) for x in rest]
        elif name == "go":
            if tree is None:
                tree = Tree.read(*urdf, names) if urdf else Tree.build(lines)
                tree.model.gravity.linear = np.array(gravity)
            tree.answer(state["q"], state["v"], state["a"], state["t"])
        else:
            state[name] = np.array([float(x) for x in rest])


ROBOTS = [
    ("panda", "panda_description/urdf/panda.urdf", False),
    ("talos", "talos_data/robots/talos_reduced.urdf", True),
    ("anymal", "anymal_b_simple_description/robots/anymal.urdf", True),
]


def robots():
    folder = data_folder()
    for name, path, floats in ROBOTS:
        file = str(folder / "robots" / path)
        print("robot", name, file)
        dump(pin.buildModelFromUrdf(file, pin.JointModelFreeFlyer()) if floats else pin.buildModelFromUrdf(file))


def data_folder():
    """Where the package example-robot-data put its files."""
    for place in sys.path:
        folder = pathlib.Path(place) / "cmeel.prefix" / "share" / "example-robot-data"
        if folder.is_dir():
            return folder
    print("no example-robot-data")
    sys.exit(77)


def dump(model):
    """The tree of a robot as lines `link`: joint axes and placements and all inertias, fixed links folded in by Pinocchio."""
    for j in range(1, model.njoints):
        joint = model.joints[j]
        made = joint.createData()
        joint.calc(made, pin.neutral(model))
        s = np.array(made.S.matrix() if hasattr(made.S, "matrix") else made.S).reshape(6, -1)
        kind = {3: "spherical", 6: "floating"}.get(joint.nv) or ("revolute" if np.linalg.norm(s[3:]) > 0.5 else "prismatic")
        axis = s[3:, 0] if kind == "revolute" else s[:3, 0] if kind == "prismatic" else np.zeros(3)
        placement, inertia = model.jointPlacements[j], model.inertias[j]
        turn = pin.Quaternion(placement.rotation).normalized().coeffs()
        numbers = [axis, placement.translation, turn, [inertia.mass], inertia.lever, inertia.inertia.ravel()]
        print("link", model.parents[j] - 1, kind, *[repr(float(x)) for x in np.concatenate(numbers)])


if __name__ == "__main__":
    {"check": check, "robots": robots}[sys.argv[1]]()
