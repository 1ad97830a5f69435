#!/usr/bin/env python3
"""Runs MuJoCo or PyBullet on the rigid scenes of `metachron bench contact`, and writes what steps take and how bodies lie.

In: nothing but MuJoCo (`pip install mujoco`) or PyBullet (`pip install pybullet`; --engine pybullet). Out: JSON for
`metachron bench contact --peers FILE` and for `metachron chart contact`. Never here: our own engine.

The scenes have the sizes, places, masses, frictions of bodies and steps of those of the benchmark; of two frictions MuJoCo takes the
greater, where ours is the geometric mean, as is PyBullet's product of the roots set here. MuJoCo has no coefficient
of restitution: a peer's run of a scene stands beside ours of e = 0 and of e > 0. Solvers and integrators are the engines' own
defaults (MuJoCo: Newton, pyramidal cones, Euler; PyBullet: 50 sequential impulses), and PyBullet reads the scenes as MuJoCo's
files, without joints and of at most 512 bodies. The boxes of `pile` are scattered as far as those of the scene file, by other numbers.
"""

import argparse
import math
import re
import sys
import tempfile
import time

import report

GRAVITY = 9.81
# The part of a run in which bodies are held to lie still, seconds before its end.
REST_S = 0.5
# Wall seconds after which a scene is left out.
PATIENCE_S = 120.0


def drawn(number, what):
    """A number between -1 and 1, as the benchmark draws it."""
    x = math.sin(12.9898 * (number + 1) + 78.233 * what) * 43758.5453
    return 2.0 * (x - math.floor(x)) - 1.0


def turn(rotation):
    """A quaternion of a rotation vector."""
    angle = math.sqrt(sum(part * part for part in rotation))
    if angle == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    share = math.sin(0.5 * angle) / angle
    return (math.cos(0.5 * angle), *(part * share for part in rotation))


def listed(numbers):
    return " ".join(repr(float(number)) for number in numbers)


def box(middle, half, mass, friction, rotation=(0.0, 0.0, 0.0)):
    """A free box."""
    return (
        f'<body pos="{listed(middle)}" quat="{listed(turn(rotation))}"><joint type="free"/>'
        f'<geom type="box" size="{listed(half)}" mass="{mass!r}" friction="{friction} 0 0"/></body>'
    )


def world(step, bodies, floor=None, walls=()):
    """A model of bodies, of a floor of this friction, and of walls of (middle, half extents)."""
    fixed = [] if floor is None else [f'<geom type="plane" size="9 9 1" friction="{floor} 0 0"/>']
    fixed += [
        f'<geom type="box" pos="{listed(middle)}" size="{listed(half)}" friction="0.5 0 0"/>' for middle, half in walls
    ]
    return (
        f'<mujoco><option timestep="{step!r}" gravity="0 0 -{GRAVITY}"/><size memory="512M"/>'
        + "\n".join(("<worldbody>", *fixed, *bodies, "</worldbody></mujoco>"))
    )


def bin_walls(inside, thick, high):
    """The four walls of a bin."""
    out, half, wide = inside + 0.5 * thick, 0.5 * thick, inside + thick
    along = [((sign * out, 0.0, high), (half, wide, high)) for sign in (-1.0, 1.0)]
    return along + [((0.0, sign * out, high), (wide, half, high)) for sign in (-1.0, 1.0)]


def tower(off):
    bodies = [
        box((off * drawn(at, 0), off * drawn(at, 1), 0.02 + 0.04 * at), (0.04, 0.04, 0.02), 0.2, 0.8) for at in range(20)
    ]
    return world(2e-3, bodies, floor=0.8)


def pendulum():
    rod = '<geom type="capsule" fromto="0.05 0 0 0.45 0 0" size="0.02" mass="1"/><joint type="hinge" axis="0 1 0"/>'
    inner = f'<body pos="0.5 0 0">{rod}</body>'
    return world(2e-3, [f"<body>{rod}{inner}</body>"])


def pile():
    bodies = []
    for k in range(1000):
        x, y, z = k % 10 - 4.5, k // 10 % 10 - 4.5, k // 100
        shift = [0.0025 * drawn(k, what) for what in range(3)]
        middle = (0.054 * x + shift[0], 0.054 * y + shift[1], 0.04 + 0.06 * z + shift[2])
        rotation = [math.radians(most) * drawn(k, 3 + axis) for axis, most in enumerate((3.0, 3.0, 12.0))]
        bodies.append(box(middle, (0.02,) * 3, 0.0448, 0.5, rotation))
    walls = [((sign * 0.312, 0.0, 0.14), (0.012, 0.324, 0.14)) for sign in (-1.0, 1.0)]
    walls += [((0.0, sign * 0.312, 0.14), (0.3, 0.012, 0.14)) for sign in (-1.0, 1.0)]
    return world(1.0 / 60.0, bodies, floor=0.6, walls=walls)


def mess(n):
    bodies = []
    for k in range(n**3):
        x, y, z = k % n - 0.5 * (n - 1), k // n % n - 0.5 * (n - 1), k // n // n
        half = 0.017 + 0.0085 * drawn(k, 0)
        rotation = [2.0 * drawn(k, what) for what in (1, 2, 3)]
        bodies.append(box((0.06 * x, 0.06 * y, 0.05 + 0.06 * z), (half,) * 3, 700.0 * (2.0 * half) ** 3, 0.5, rotation))
    return world(1.0 / 60.0, bodies, floor=0.6, walls=bin_walls(0.03 * n + 0.005, 0.024, 0.05 * n))


def bricks(wide, layers):
    bodies = []
    for k in range(wide * wide * layers):
        x, y, layer = k % wide, k // wide % wide, k // wide // wide
        shift = 0.03 * (layer % 2)
        yaw = 0.05 * math.sin(12.9898 * (k + 1))
        middle = (0.065 * x + shift, 0.065 * y + shift, 0.0302 + 0.0604 * layer)
        bodies.append(box(middle, (0.03,) * 3, 0.5, 0.5, (0.0, 0.0, yaw)))
    return world(1.0 / 60.0, bodies, floor=0.5)


def stack(ratio):
    bodies = [
        box((0.001 * (i % 3), 0.0, 0.03 + 0.0602 * i), (0.03,) * 3, 0.05, 0.5, (0.0, 0.0, 0.3 * i)) for i in range(10)
    ]
    bodies.append(box((0.0, 0.0, 0.632), (0.03,) * 3, 0.05 * ratio, 0.5, (0.0, 0.0, 0.1)))
    return world(1.0 / 60.0, bodies, floor=0.5)


def chain(ratio):
    text = ""
    for i in reversed(range(20)):
        mass = ratio if i == 19 else 1.0
        geom = f'<geom type="capsule" fromto="0 0 -0.04 0 0 -0.16" size="0.03" mass="{mass!r}"/>'
        quat = f' quat="{listed(turn((0.0, -0.25 * math.pi, 0.0)))}"' if i == 0 else ' pos="0 0 -0.2"'
        text = f'<body{quat}><joint type="ball"/>{geom}{text}</body>'
    return world(1.0 / 60.0, [text])


SCENES = [
    *((f"tower, off by {off} mm, e {e}", 3.0, lambda off=off: tower(off * 1e-3)) for off in (12, 25, 35) for e in ("0", "0.2")),
    ("pendulum", 20.0, pendulum),
    *((f"pile, {how}", 1.5, pile) for how in ("one problem, e 0", "one problem, e 0.1", "a heap, e 0")),
    ("mess_small", 1.5, lambda: mess(6)),
    ("bricks", 1.0, lambda: bricks(10, 10)),
    ("stack", 2.0, lambda: stack(1000.0)),
    ("chain", 2.0, lambda: chain(100.0)),
]

# Scenes that PyBullet's importer does not take: balls and hinges on the world, and files of more than 512 bodies.
UNSUPPORTED = ("pendulum", "chain", "pile", "bricks")


def share(sorted_list, of):
    return sorted_list[round(of * (len(sorted_list) - 1))]


class Mujoco:
    """A scene in MuJoCo."""

    def __init__(self, text):
        self.module = report.load("mujoco")
        self.name = f"MuJoCo {report.version('mujoco')}"
        self.model = self.module.MjModel.from_xml_string(text)
        self.model.opt.enableflags |= self.module.mjtEnableBit.mjENBL_ENERGY
        self.data = self.module.MjData(self.model)
        self.step_s = self.model.opt.timestep
        self.module.mj_forward(self.model, self.data)

    def step(self):
        self.module.mj_step(self.model, self.data)

    def places(self):
        return [tuple(place) for place in self.data.xipos[1:]]

    def energy_j(self):
        return float(sum(self.data.energy))

    def depth_m(self):
        return float(-self.data.contact.dist.min()) if self.data.ncon else 0.0


class Pybullet:
    """A scene in PyBullet, without joints, of at most 512 bodies."""

    def __init__(self, text):
        self.module = report.load("pybullet")
        self.name = f"PyBullet {report.version('pybullet')}"
        self.step_s = float(re.search('timestep="([^"]+)"', text)[1])
        if not self.module.isConnected():
            self.module.connect(self.module.DIRECT)
        self.module.resetSimulation()
        self.module.setGravity(0.0, 0.0, -GRAVITY)
        self.module.setTimeStep(self.step_s)
        with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
            file.write(text)
            file.flush()
            loaded = self.module.loadMJCF(file.name)
        free = [body for body in loaded if self.module.getDynamicsInfo(body, -1)[0] > 0.0]
        self.bodies = []
        # the importer ignores the masses of geoms, and frictions are multiplied
        for body in loaded:
            friction = self.module.getDynamicsInfo(body, -1)[1]
            self.module.changeDynamics(body, -1, lateralFriction=friction**0.5)
        for body, mass in zip(free, map(float, re.findall(' mass="([^"]+)"', text)), strict=True):
            self.module.changeDynamics(body, -1, mass=mass, linearDamping=0.0, angularDamping=0.0)
            self.bodies.append((body, mass, self.module.getDynamicsInfo(body, -1)[2]))

    def step(self):
        self.module.stepSimulation()

    def places(self):
        return [self.module.getBasePositionAndOrientation(body)[0] for body, _, _ in self.bodies]

    def energy_j(self):
        total = 0.0
        for body, mass, inertia in self.bodies:
            place, rotation = self.module.getBasePositionAndOrientation(body)
            velocity, spin = self.module.getBaseVelocity(body)
            back = self.module.invertTransform((0.0, 0.0, 0.0), rotation)[1]
            own = self.module.multiplyTransforms((0.0, 0.0, 0.0), back, spin, (0.0, 0.0, 0.0, 1.0))[0]
            moving = mass * sum(v * v for v in velocity) + sum(i * w * w for i, w in zip(inertia, own))
            total += 0.5 * moving + mass * GRAVITY * place[2]
        return total

    def depth_m(self):
        return max((-point[8] for point in self.module.getContactPoints()), default=0.0)


ENGINES = {"mujoco": Mujoco, "pybullet": Pybullet}


def run(test, seconds, scene):
    """One row; `None` for what takes too long."""
    start = scene.places()
    settled, landing_m, rest_m, made_j, least_j, spent_ms = None, 0.0, 0.0, 0.0, scene.energy_j(), []
    begun = time.monotonic()
    for step in range(round(seconds / scene.step_s)):
        if settled is None and step * scene.step_s > seconds - REST_S:
            settled = scene.places()
        from_s = time.process_time()
        scene.step()
        spent_ms.append((time.process_time() - from_s) * 1e3)
        if settled is None:
            landing_m = max(landing_m, scene.depth_m())
        else:
            rest_m = max(rest_m, scene.depth_m())
        energy_j = scene.energy_j()
        made_j, least_j = max(made_j, energy_j - least_j), min(least_j, energy_j)
        if time.monotonic() - begun > PATIENCE_S:
            return None
    end = scene.places()
    went = [math.dist(a, b) for a, b in zip(start if settled is None else settled, end)]
    highest = max(range(len(start)), key=lambda at: start[at][2])
    ordered = sorted(spent_ms)
    return {
        "test": test,
        "bodies": len(start),
        "steps": len(spent_ms),
        "ms_p50": round(share(ordered, 0.5), 4),
        "ms_p99": round(share(ordered, 0.99), 4),
        "ms_most": round(ordered[-1], 4),
        "cpu_s": round(sum(spent_ms) * 1e-3, 5),
        "landing_m": round(landing_m, 8),
        "rest_m": round(rest_m, 8),
        "drift_mean_m": round(sum(went) / len(went), 8),
        "drift_most_m": round(max(went), 8),
        "sank_m": round(start[highest][2] - end[highest][2], 6),
        "made_j": round(made_j, 6),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("out", nargs="?", help="where the JSON goes; standard output where not given")
    parser.add_argument("--only", action="append", default=[], help="only tests whose names begin with this")
    parser.add_argument("--engine", choices=ENGINES, default="mujoco", help="which engine runs")
    arguments = parser.parse_args()
    rows, name = [], ""
    for test, seconds, text in SCENES:
        if arguments.only and not any(test.startswith(only) for only in arguments.only):
            continue
        if arguments.engine == "pybullet" and test.startswith(UNSUPPORTED):
            continue
        scene = ENGINES[arguments.engine](text())
        name = scene.name
        row = run(test, seconds, scene)
        if row is None:
            print(f"{test}: takes longer than {PATIENCE_S:.0f} s, left out", file=sys.stderr)
            continue
        rows.append(row)
        print(f"{test}: {row['ms_p50']} ms a step, {row['cpu_s']} s in all", file=sys.stderr)
    if not rows:
        sys.exit("no test was run: expected --only with the beginning of one of: " + ", ".join(test for test, _, _ in SCENES))
    report.write(name, rows, arguments.out)


if __name__ == "__main__":
    main()
