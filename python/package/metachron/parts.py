"""Parts of a scene: solids, bodies, tubes, soft bodies, kinds of joints, sensors; and cameras. They hold numbers and nothing else.

What is `None` is as the engine has it by default. Units are SI; a rotation is a quaternion (x, y, z, w) of any length above zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Literal, final

from .typing import Numbers


@dataclass(frozen=True, kw_only=True)
class _Placed:
    """Where a solid is at the start, and its surface."""

    at: Numbers | None = None
    """Position of its shape's origin, m; default the origin."""
    rotation: Numbers | None = None
    """From its shape's axes to the world's."""
    friction: float | None = None
    """Coulomb friction coefficient, >= 0; default 0.5."""
    restitution: float | None = None
    """Coefficient of restitution, 0 ... 1; default 0. Of two that meet the greater counts."""


@dataclass(frozen=True, kw_only=True)
class _Moving(_Placed):
    """A rigid body, or with none of these a solid that is fixed."""

    mass: float | None = None
    """kg, 1e-9 ... 1e9; default 1."""
    velocity: Numbers | None = None
    """Velocity at the start, m/s; default at rest."""
    rate: float | None = None
    """Steps a simulated second, 1 ... 100000; default 240."""
    kinematic: bool = False
    """Whether `World.pose` leads it, and it gives way to nothing."""
    gravity_scale: float | None = None
    """How many times as strong gravity is for it; default 1."""
    damping: tuple[float, float] | None = None
    """Rates by which its velocity and its angular momentum decay, 1/s; default none."""


@final
@dataclass(frozen=True)
class Plane(_Placed):
    """The half space below its z = 0; only as a fixed solid."""


@final
@dataclass(frozen=True)
class Ball(_Moving):
    """A ball."""

    radius: float
    """m, > 0."""


@final
@dataclass(frozen=True)
class Box(_Moving):
    """A box about its origin."""

    half_extents: Numbers
    """Half of each edge, m, > 0."""


@final
@dataclass(frozen=True)
class Capsule(_Moving):
    """A capsule along z about its origin."""

    radius: float
    """m, > 0."""
    half_height: float
    """Half the length of its straight part, m, > 0."""


@final
@dataclass(frozen=True)
class Cylinder(_Moving):
    """A cylinder along z about its origin."""

    radius: float
    """m, > 0."""
    half_height: float
    """Half its length, m, > 0."""


@final
@dataclass(frozen=True)
class Tube:
    """A soft tube, cable or rod along points: by default of soft tissue, solid, both ends free."""

    points: Sequence[Numbers] | Numbers
    """At least two, m; an array of shape (n, 3) or a list of triples."""
    radius: float | None = None
    """Outer radius, m, > 0; default 0.01."""
    wall: float | None = None
    """Thickness of its wall, m, above 0 and at most its radius; `None` for a solid one."""
    young: float | None = None
    """Young's modulus, Pa, > 0; default 1e6."""
    density: float | None = None
    """kg/m3, > 0; default 1050."""
    segments: int | None = None
    """Number of equal parts, 2 ... 4096; default 40."""
    clamp: Sequence[Literal["start", "end"]] = ()
    """Ends that are held in position and direction."""
    damping: float | None = None
    """Mass-proportional damping, 1/s, >= 0; default 0."""
    rate: float | None = None
    """Steps a simulated second, 1 ... 100000; default 240."""


@dataclass(frozen=True, kw_only=True)
class _Soft:
    """What bends: by default of soft tissue, free, without damping."""

    at: Numbers | None = None
    """Position of its middle at the start, m; of a rope or a mesh of the origin of its points."""
    rotation: Numbers | None = None
    """From its own axes to the world's."""
    velocity: Numbers | None = None
    """Velocity at the start, m/s; default at rest."""
    young: float | None = None
    """Young's modulus, Pa, 1 ... 1e11; default 1e5."""
    poisson: float | None = None
    """Poisson's ratio, 0 ... 0.499; default 0.4."""
    density: float | None = None
    """kg/m3, 1 ... 1e5; default 1050."""
    damping: tuple[float, float] | None = None
    """Of its motion, 1/s, 0 ... 1e4, and of its strains, s, 0 ... 10; default none."""
    law: Literal["corotational", "neo-hookean", "ogden"] | None = None
    """How the stress of a solid follows from its strain; default corotational."""
    exponent: float | None = None
    """Of the law of Ogden, 1 ... 20 or -20 ... -1."""
    hold: Sequence[Literal["left", "right", "near", "far", "bottom", "top"]] = ()
    """Sides that never move, in its own axes: least and largest x, y, z; of a rope left is its start and right its end."""
    friction: float | None = None
    """Coulomb friction coefficient, >= 0; default 0.3."""
    self_contact: bool | None = None
    """Whether it touches itself; by default sheets and ropes do."""
    eps_touched: float | None = None
    """Where something touches a solid with `eps`, cells longer than this are halved, m."""
    rate: float | None = None
    """Steps a simulated second, 1 ... 100000; default 240."""


@dataclass(frozen=True, kw_only=True)
class _Celled(_Soft):
    """What is divided into cells of its own."""

    eps: tuple[float, float] | None = None
    """The finest and the coarsest spacing of its nodes, m, instead of a fixed number of cells: it begins with the finest."""


@final
@dataclass(frozen=True)
class Sheet(_Celled):
    """A flat sheet in its x and y."""

    size: tuple[float, float]
    """Its lengths, m, > 0."""
    thickness: float
    """m, > 0."""
    segments: tuple[int, int]
    """Number of cells along both."""


@final
@dataclass(frozen=True)
class SoftBox(_Celled):
    """A soft box."""

    size: tuple[float, float, float]
    """Its lengths, m, > 0."""
    segments: tuple[int, int, int]
    """Number of cells along each."""


@final
@dataclass(frozen=True)
class SoftBall(_Celled):
    """A soft ball."""

    radius: float
    """m, > 0."""
    segments: int
    """Number of cells across it."""


@final
@dataclass(frozen=True)
class Rope(_Celled):
    """A rope, which does not resist bending."""

    points: Sequence[Numbers] | Numbers
    """At least two, m; an array of shape (n, 3) or a list of triples."""
    radius: float
    """m, > 0."""
    segments: int
    """Number of equal pieces."""


@final
@dataclass(frozen=True)
class SoftMesh(_Soft):
    """What the closed surface in a file encloses: STL, OBJ or .glb."""

    file: str | PathLike[str]
    """Its path."""
    eps: tuple[float, float]
    """The finest and the coarsest cells of the cage around it, m: it begins with the finest."""
    scale: float = 1.0
    """Metres in a unit of the file."""


@dataclass(frozen=True, kw_only=True)
class _Joint:
    """A joint between two bodies, or of one with the world. Its place and its axis are in the world's axes, as the bodies are at the start."""

    at: Numbers
    """Where both bodies are joined at the start, m, world axes."""


@final
@dataclass(frozen=True)
class Revolute(_Joint):
    """A hinge at a place and about an axis of the world at the start."""

    axis: Numbers
    """In the world's axes at the start, of any length above zero; it turns with the first body."""
    range: tuple[float, float] | None = None
    """How far the second body turns relative to the first about the axis, rad, within -pi ... pi."""


@final
@dataclass(frozen=True)
class Prismatic(_Joint):
    """A slide along an axis of the world at the start."""

    axis: Numbers
    """In the world's axes at the start, of any length above zero; it turns with the first body."""
    range: tuple[float, float] | None = None
    """How far the second body slides relative to the first along the axis, m."""


@final
@dataclass(frozen=True)
class Spherical(_Joint):
    """A ball in its socket at a place of the world at the start."""


@final
@dataclass(frozen=True)
class Fixed(_Joint):
    """Nothing moves; its place is one of the world at the start."""


@final
@dataclass(frozen=True)
class Imu:
    """An accelerometer and a gyroscope on a rigid body: the acceleration there less that of gravity, m/s2, then the spin, rad/s, in its own axes."""

    object: str
    """The body's name."""
    at: Numbers | None = None
    """Its place, m in the axes of the body's shape; default the centre of mass."""
    rotation: Numbers | None = None
    """From its own axes to those of the shape; default none."""


@final
@dataclass(frozen=True)
class Pose:
    """Where a point of a rigid body is, m, and the rotation of its shape's axes, (x, y, z, w)."""

    object: str
    """The body's name."""
    at: Numbers = (0.0, 0.0, 0.0)
    """The point, m in the axes of its shape."""


@final
@dataclass(frozen=True)
class ContactForce:
    """What touches an object gives it, N, world axes."""

    object: str
    """The object's name."""
    other: str | None = None
    """The object or fixed solid whose contacts count; default all."""


@final
@dataclass(frozen=True)
class JointPosition:
    """How far the second body of a joint has moved from the first, rad or m."""

    joint: str
    """The joint's name."""


@final
@dataclass(frozen=True)
class JointVelocity:
    """How fast it moves, rad/s or m/s."""

    joint: str
    """The joint's name."""


@final
@dataclass(frozen=True)
class JointEffort:
    """What its motor and its stops give the second body together, N m or N."""

    joint: str
    """The joint's name."""


@final
@dataclass(frozen=True)
class Camera:
    """A view for `World.render`; up is +z."""

    eye: Numbers
    """Where it is, m."""
    look_at: Numbers
    """The point in the middle of the picture, m."""
    fov: float = 0.7
    """Vertical angle of view, rad, 0.01 ... 3."""


Solid = Plane | Ball | Box | Capsule | Cylinder
Part = Ball | Box | Capsule | Cylinder | Tube | Sheet | SoftBox | SoftBall | SoftMesh | Rope
JointKind = Revolute | Prismatic | Spherical | Fixed
Sensor = Imu | Pose | ContactForce | JointPosition | JointVelocity | JointEffort
