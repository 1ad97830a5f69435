"""A real-time physics engine in which every object keeps its own time.

A scene is built of parts, or read from TOML; started, it is a world whose objects live on threads, in a pool or in lockstep.
Units are SI: metres, seconds, kilograms, newtons, radians. Rotations are quaternions (x, y, z, w) of any length above zero.
"""

from typing import TYPE_CHECKING

from ._metachron import (
    Checkpoint,
    Contact,
    Event,
    Events,
    Export,
    Hit,
    Joint,
    Joints,
    Object,
    RemoteWorld,
    Rollout,
    Scene,
    State,
    States,
    World,
    WorldCalls,
    __version__,
    connect,
    replay,
    rollout,
)
from .parts import (
    Ball,
    Box,
    Camera,
    Capsule,
    ContactForce,
    Cylinder,
    Fixed,
    Imu,
    JointEffort,
    JointPosition,
    JointVelocity,
    Plane,
    Pose,
    Prismatic,
    Revolute,
    Rope,
    Sheet,
    SoftBall,
    SoftBox,
    SoftMesh,
    Spherical,
    Tube,
)

__all__ = [
    "Ball",
    "Box",
    "Camera",
    "Capsule",
    "Checkpoint",
    "Contact",
    "ContactForce",
    "Cylinder",
    "Event",
    "Events",
    "Export",
    "Fixed",
    "Hit",
    "Imu",
    "Joint",
    "JointEffort",
    "JointPosition",
    "JointVelocity",
    "Joints",
    "Object",
    "Plane",
    "Pose",
    "Prismatic",
    "RemoteWorld",
    "Revolute",
    "Rollout",
    "Rope",
    "Scene",
    "Sheet",
    "SoftBall",
    "SoftBox",
    "SoftMesh",
    "Spherical",
    "State",
    "States",
    "Tube",
    "World",
    "WorldCalls",
    "__version__",
    "connect",
    "replay",
    "rollout",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name == "Weld":
            raise AttributeError("metachron.Weld is named metachron.Fixed, as in scene files")
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
