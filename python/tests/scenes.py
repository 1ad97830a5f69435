"""Scenes of the tests."""

import metachron as mc

# the text of a scene with a ball, whose table goes on
BALL = """format = 1
[[object]]
name = "ball"
model = "rigid"
shape = "ball"
radius_m = 0.1
"""

# the text of a scene with one object whose steps of 1 ms take 3 ms each, and another in time
SLOW = """format = 1
[[object]]
name = "slow"
model = "synthetic"
rate_hz = 1000
cost_us = 3000

[[object]]
name = "quick"
model = "synthetic"
rate_hz = 100
cost_us = 10
"""


def falling(height: float = 10.0) -> mc.Scene:
    """A ball of 0.2 kg in free fall."""
    return mc.Scene().add("ball", mc.Ball(0.05, mass=0.2, at=[0.0, 0.0, height]))


def floating() -> mc.Scene:
    """A ball of 0.5 kg without gravity."""
    return mc.Scene(gravity=[0.0, 0.0, 0.0]).add("ball", mc.Ball(0.1, mass=0.5))


def bouncing() -> mc.Scene:
    """A ball of 0.2 kg half a metre above a floor, that rebounds with half its speed."""
    floor = mc.Plane(restitution=0.0)
    return mc.Scene().fixed("floor", floor).add("ball", mc.Ball(0.05, mass=0.2, at=(0.3, 0.0, 0.55), restitution=0.5))


def tube(rate: float = 240.0) -> mc.Scene:
    """A tube that hangs between its clamped ends over a floor."""
    points = [[-0.3, 0.0, 0.5], [0.3, 0.0, 0.5]]
    gut = mc.Tube(points, radius=0.015, wall=0.002, segments=20, clamp=["start", "end"], rate=rate)
    return mc.Scene().fixed("floor", mc.Plane()).add("gut", gut)
