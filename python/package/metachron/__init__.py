"""A real-time physics engine in which every object keeps its own time.

A scene is built of parts, or read from TOML; started, it is a world whose objects live on threads, in a pool or in lockstep.
Units are SI: metres, seconds, kilograms, newtons, radians. Rotations are unit quaternions (x, y, z, w).
"""

from ._metachron import Checkpoint, Contact, Event, Events, Export, Hit, Object, Rollout, Scene, State, World, replay, rollout
from .parts import (
    Ball,
    Box,
    Capsule,
    Cylinder,
    Plane,
    Prismatic,
    Revolute,
    Rope,
    Sheet,
    SoftBall,
    SoftBox,
    SoftMesh,
    Spherical,
    Tube,
    Weld,
)

__all__ = [
    "Ball",
    "Box",
    "Capsule",
    "Checkpoint",
    "Contact",
    "Cylinder",
    "Event",
    "Events",
    "Export",
    "Hit",
    "Object",
    "Plane",
    "Prismatic",
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
    "Tube",
    "Weld",
    "World",
    "replay",
    "rollout",
]
