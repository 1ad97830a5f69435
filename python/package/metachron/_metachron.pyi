"""The native part: scenes, worlds, states, events. Errors are exceptions with the engine's own sentences."""

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Final, Literal, TypedDict, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Required, Self, Unpack, disjoint_base

from .parts import Camera, JointKind, Part, Sensor, Solid
from .typing import Array, Numbers

__all__ = [
    "Checkpoint", "Contact", "Event", "Events", "Export", "Hit", "Joint", "Joints", "Object", "RemoteWorld", "Rollout", "Scene", "State", "States",
    "World", "WorldCalls", "__version__", "connect", "replay", "rollout",
]

__version__: Final[str]

_Executor = Literal["lockstep", "threads", "pool", "auto"]
_Pace = Literal["real-time", "free"]
_Coordinates = Mapping[str | int, float] | Sequence[float] | NDArray[np.floating[Any]]

class _Point(TypedDict, total=False):
    """A material point: one of three, or none for the centre of mass of a rigid body."""

    arc: float | None
    """Of a tube, the rest length from its start, m."""
    local: Numbers | None
    """Of a rigid body or tool, m from its centre of mass or tip in its own axes."""
    vertex: int | None
    """Of a sheet, solid or rope, a vertex."""

class _Lasting(_Point, total=False):
    key: int
    """0 ... 7: the newest command of a key replaces the one before; default 0. Forces and torques share keys."""
    expires: float | None
    """For how many seconds of the object's time it acts; `None` until it is replaced or taken back."""

class _Spring(_Lasting, total=False):
    stiffness: float | None
    """N/m, >= 0; required but to take a spring back."""
    damping: float
    """N s/m, >= 0; default 0."""

class _Motor(TypedDict, total=False):
    velocity: float | None
    """rad/s or m/s: how the second body moves relative to the first."""
    position: float | None
    """rad or m; needs `stiffness`."""
    stiffness: float | None
    """Of a motor to a position, N m/rad or N/m."""
    damping: float | None
    """Of a motor to a position, N m s/rad or N s/m; default 0."""
    max_effort: float | None
    """N m or N, > 0; default as much as it takes."""
    expires: float | None
    """For how many seconds it acts; `None` until it is replaced or taken back."""

class _Led(TypedDict, total=False):
    velocity: Numbers
    """How the pose moves on, m/s; default not."""
    spin: Numbers
    """How it turns on, rad/s, world axes; default not."""
    expires: float | None
    """For how many seconds of the object's time it leads; `None` until it is replaced or taken back."""

class _Rollout(_Point, total=False):
    step: Required[float]
    """Seconds that each action acts for."""
    observe: Sequence[str] | None
    """Objects whose motion is recorded; default that on which the actions act."""
    threads: int
    """Worlds that are played at once; default 2."""

@final
class Object:
    """An object of one world: quicker to find than its name, and never another one of the same name."""

    @property
    def name(self) -> str: ...
    def __hash__(self) -> int: ...

@final
class Joint:
    """A joint of a world."""

    @property
    def number(self) -> int:
        """Its place in the scene, from 0."""

    @property
    def name(self) -> str | None: ...
    @property
    def kind(self) -> Literal["revolute", "prismatic", "spherical", "fixed", "spring", "rope"]: ...
    @property
    def a(self) -> str:
        """Its first body."""

    @property
    def b(self) -> str | None:
        """Its second body, which its coordinate moves against the first; `None` for the world."""

    @property
    def range(self) -> tuple[float, float] | None:
        """Of a hinge or a slide, rad or m; `None` where it has none."""

@final
class Joints:
    """The joints of a world, in the order of its scene; the arrays have a number for each hinge and slide of them."""

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Joint]: ...
    def __getitem__(self, joint: str | int, /) -> Joint: ...
    @property
    def positions(self) -> Array:
        """(n,), rad and m: how far each hinge and slide has moved from its zero, of the newest states, or as it was set since."""

    @property
    def velocities(self) -> Array:
        """(n,), rad/s and m/s: how fast they do."""

    def set(self, positions: _Coordinates | None = None, velocities: _Coordinates | None = None) -> None:
        """Puts hinges and slides to coordinates before the next step, and all bodies that they carry: a number for each of them, or a dictionary of
        some by name. The others, and joints given `None`, keep theirs. The root of a tree of joints stays: the world,
        a kinematic body, or else its first.

        Raises `ValueError`, and moves nothing, outside a joint's range, where a loop of joints would be open, and while time passes.
        """

    def reset(self) -> None:
        """Puts all joints back to where the scene has them at the start, at rest; the root of a tree of joints stays where it is."""

@final
class Scene:
    """A scene, complete or in the making."""

    def __new__(
        cls, *, gravity: Numbers | None = None, contact: Literal["budget", "exact"] = ..., contact_least_steps: int = ...
    ) -> Self:
        """An empty scene; gravity in m/s2, by default 9.81 along -z.

        Solves of contact go to their end. With `contact="budget"` they go as far as there is time in real time, and in lockstep at the pace
        "real-time", and `contact_least_steps` (1 to 400) in any case.
        """

    @staticmethod
    def from_toml(
        text_or_path: str | PathLike[str], *, allow_outside: bool = False, memory_limit: int | None = None
    ) -> Scene:
        """Reads a text that has a line break as the scene itself, any other as a path, or as the name of a built-in scene.

        Files outside of the scene's folder are read with `allow_outside` alone, and what may take more memory than `memory_limit` bytes is refused;
        `None` is half of the machine's.

        Raises `ValueError` with every problem, a line each, with its line and column.
        """

    def fixed(self, name: str, solid: Solid) -> Self:
        """Adds a solid that never moves."""

    def add(self, name: str, what: Part) -> Self:
        """Adds a moving object: a rigid body, a tube, a sheet, a solid or a rope."""

    def joint(
        self,
        name: str,
        kind: JointKind,
        a: str,
        b: str | None = None,
        *,
        friction: float = 0.0,
        armature: float = 0.0,
        mimic: str | None = None,
        ratio: float | None = None,
    ) -> Self:
        """Joins the rigid bodies `a` and `b`, or `a` and the world. Place and axis of `kind` are in the world's axes, as the bodies are at the start.

        `friction` is dry, beside a motor: N·m of a hinge or a ball, N of a slide. `armature` is the inertia of a rotor behind its gear: kg·m², of a slide kg.
        A hinge or slide follows the joint `mimic`, one too: its travel is `ratio` (1) times that one's, rad or m for each rad or m.
        """

    def sensor(self, name: str, on: Sensor) -> Self:
        """Adds a sensor, which `World.sensor` reads."""

    def start(self, executor: _Executor = "lockstep", pace: _Pace | None = None) -> World:
        """Starts a world of it, whose time stands at first. Raises `ValueError` for what cannot be built.

        At the pace `"free"`, the default in lockstep, time waits for objects: none gives up time or makes longer steps than it was asked for. At
        `"real-time"`, the default on other executors, it passes beside the clock, and an object that is too slow for it does; in lockstep that
        is by what the scene's declared machine costs.
        """

@final
class Checkpoint:
    """All that the next bit of a world needs (`World.checkpoint`)."""

    @staticmethod
    def read(path: str | PathLike[str]) -> Checkpoint:
        """The one that a file holds. Raises `OSError`, and `ValueError` for a file that is no checkpoint of this version, or is damaged."""

    def write(self, path: str | PathLike[str]) -> None:
        """Writes it to a file, in place of one that is there. Raises `OSError`."""

    @property
    def time(self) -> float:
        """Simulated time of the state, s."""

@disjoint_base
class WorldCalls:
    """The calls that a world answers wherever it runs: any thread may read and command it."""

    def object(self, name: str) -> Object:
        """The object of this name. Raises `KeyError`."""

    @property
    def objects(self) -> list[Object]:
        """All objects that are there, the scene's first."""

    def states(self) -> States:
        """The newest states of all objects, as arrays."""

    def state(self, object: str | Object) -> State:
        """The newest state of an object; it waits for nothing."""

    @property
    def time(self) -> float:
        """Simulated time, s."""

    def hash(self) -> int:
        """Equal numbers mean the same states of all objects, bit for bit."""

    def force(self, object: str | Object, newtons: Numbers | None, **keywords: Unpack[_Lasting]) -> None:
        """A force in world axes; `None` takes back that of the key."""

    def torque(self, object: str | Object, newton_metres: Numbers | None, **keywords: Unpack[_Lasting]) -> None:
        """A torque in world axes; `None` takes back that of the key."""

    def impulse(self, object: str | Object, newton_seconds: Numbers, **keywords: Unpack[_Point]) -> None:
        """An impulse in world axes, once."""

    def spring(self, object: str | Object, target: Numbers | None, **keywords: Unpack[_Spring]) -> None:
        """A spring to a place in space, m; `None` takes back that of the key."""

    def pose(
        self, object: str | Object, position: Numbers | None, rotation: Numbers = ..., **keywords: Unpack[_Led]
    ) -> None:
        """Leads a kinematic body to a pose within its next step, and along by a velocity, m/s, and a spin, rad/s; `None` lets it go."""

    def set_state(self, object: str | Object, state: State) -> None:
        """Puts an object into a state that it had, or another one of as many nodes."""

    def set_nodes(self, object: str | Object, positions: ArrayLike, velocities: ArrayLike | None = None) -> None:
        """Puts the nodes of a soft body to these places, m, (n, 3), with these velocities, m/s; at rest where there are none. How many nodes it has,
        `State.nodes` says.
        """

    def teleport(self, object: str | Object, position: Numbers, rotation: Numbers = ...) -> None:
        """To another place: a rigid body to this rotation, a deformable turned by it."""

    def velocity(self, object: str | Object, velocity: Numbers, spin: Numbers = ...) -> None:
        """Another velocity, m/s, and spin, rad/s, of all its matter."""

    def carve(self, object: str | Object, start: Numbers, radius: float, end: Numbers | None = ...) -> None:
        """Removes the cells of a solid or a sheet within a radius of a line, m; of a point where it has no other end."""

    def add(self, name: str, what: Part) -> Object:
        """Takes up another object, which lives from its first step on."""

    def remove(self, object: str | Object) -> None:
        """Takes an object out; its handle is an error from its next step on."""

    def events(
        self, *, contacts: bool = True, states: bool = True, above: float = 0.0, of: str | Object | None = None
    ) -> Events:
        """Listens from now on: to contacts of at least `above` newtons, to changes of state, of all objects or one."""

    def checkpoint(self) -> Checkpoint:
        """All that the next bit of it needs, objects that joined it included."""

    def restore(self, checkpoint: Checkpoint) -> None:
        """Goes back to a checkpoint of this world, or of another of the same scene."""

    def advance(self, seconds: float) -> None:
        """Lets so much simulated time pass. Other threads of Python run meanwhile."""

    def run(self, speed: float = 1.0) -> None:
        """Lets time pass from now on, so many simulated seconds a second, 0.001 ... 100."""

    def pause(self) -> None:
        """Stops time."""

@final
class World(WorldCalls):
    """A world that runs; any thread may read and command it. In a `with` block it stops at the end."""

    @staticmethod
    def from_toml(text_or_path: str | PathLike[str], executor: _Executor = "lockstep", pace: _Pace | None = None) -> World:
        """`Scene.from_toml(text_or_path).start(executor, pace)`."""

    @property
    def joints(self) -> Joints:
        """The joints of its scene, and their coordinates."""

    @property
    def sensors(self) -> list[str]:
        """The names of the sensors of its scene."""

    def fault(self, object: str | Object) -> str | None:
        """Why an object failed: it stands still from then on, and its newest state is its last. `None` of one that lives."""

    @property
    def executor(self) -> str:
        """The executor that runs it."""

    @property
    def pace(self) -> str:
        """How time passes: `"free"` where it waits for objects, else `"real-time"`, whatever its speed."""

    def set_pace(self, pace: _Pace | float) -> None:
        """How time passes from now on: `"free"`, `"real-time"`, or so many simulated seconds a second, 0.001 ... 100."""

    @property
    def dropped(self) -> float:
        """The most simulated time that one of its objects has not lived, s: its dropped time and its lag now. 0 at the pace `"free"`."""

    def checkpoint(self) -> Checkpoint:
        """All that the next bit of it needs, objects that joined it included."""

    def restore(self, checkpoint: Checkpoint) -> None:
        """Goes back to a checkpoint of this world, or of another of the same scene: from there it repeats its steps, in
        lockstep to the bit. Objects that joined since are taken out, objects that left since are there again."""

    def advance(self, seconds: float) -> None:
        """Lets so much simulated time pass: at once in lockstep, on other executors in real time or, at the pace `"free"`, as fast as objects can
        step. Other threads of Python run meanwhile."""

    def run(self, speed: float = 1.0) -> None:
        """Lets time pass from now on, so many simulated seconds a second, 0.001 ... 100; the pace is no longer `"free"`. Not in lockstep."""

    def pause(self) -> None:
        """Stops time."""

    def stop(self) -> None:
        """Ends the world. Its newest states can still be read."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *error: Any) -> None: ...
    def sensor(self, name: str) -> Array:
        """The reading of a sensor of the scene, of the newest states. Raises `KeyError`."""

    def motor(self, joint: str | int, **keywords: Unpack[_Motor]) -> None:
        """Drives a joint, by name or by its number in the scene; without a goal, no longer."""

    def render(self, size: tuple[int, int] = ..., camera: str | Camera | None = None) -> NDArray[np.uint8]:
        """A picture of the world now, (height, width, 4) of `uint8`: red, green, blue, opacity. `size` is (width, height), default (1280, 720).

        The camera is one of the scene's, by its name, or a `Camera`; default the scene's first, or one that sees everything. Raises `KeyError`
        for a name that there is not, and `RuntimeError` where no graphics adapter is found: a software driver is enough.
        """

    def render_depth(self, size: tuple[int, int] = ..., camera: str | Camera | None = None) -> NDArray[np.float32]:
        """The depths that a camera sees now, (height, width) of `float32`: m along the view from the eye, infinite where there is nothing. `size`,
        `camera` and errors are as of `render`.
        """

    def export(
        self,
        *,
        mcap: str | PathLike[str] | None = None,
        vtk: str | PathLike[str] | None = None,
        glb: str | PathLike[str] | None = None,
        perfetto: str | PathLike[str] | None = None,
    ) -> Export:
        """Begins files for other programs: moments as MCAP for Foxglove, Lichtblick and Rerun, in a folder as VTK series for ParaView, or as one
        animated binary glTF (.glb) for Blender and three.js; for ui.perfetto.dev when each object stepped.
        """

    def write_glb(self, path: str | PathLike[str]) -> None:
        """Writes the surfaces of all objects, as they are now, as binary glTF (.glb). Raises `OSError`."""

    def record(self, path: str | PathLike[str]) -> None:
        """Writes down all calls that change it from now on, so that `replay` repeats them to the bit. Raises `OSError`; `RuntimeError` on
        a world that has stopped, is recorded already or repeats a recording.
        """

    def end_recording(self) -> bool:
        """Ends the recording, as `stop` does; whether there was one. Raises `OSError` if not all of it could be written."""

    @property
    def replayed(self) -> float | None:
        """The share of its recording that it has played, 0 ... 1; `None` of a world that is no replay. Raises `RuntimeError` where the replay
        came to something that the recorded world did not.
        """

    def contacts(self, object: str | Object) -> list[Contact]:
        """The contacts of an object now."""

    def cast_ray(self, origin: Numbers, direction: Numbers, reach: float) -> Hit | None:
        """The first surface that a ray meets within `reach` metres."""

    def nearest(self, point: Numbers, reach: float) -> Hit | None:
        """The nearest point of any surface within `reach` metres."""

@final
class RemoteWorld(WorldCalls):
    """A world that another process serves (`connect`): reading shows the newest states that came, what changes it waits for its host's answer.

    Where its host is silent, states stay as they were last seen, and calls raise `ConnectionError`; where it lives again, they go on.
    """

    @property
    def is_silent(self) -> bool:
        """Whether its host is silent: it has ended, or sent nothing for a second."""

@final
class State:
    """The state of an object at one moment. It never changes; its arrays are copies that nobody can write to."""

    def __new__(cls, pickled: bytes) -> Self: ...
    @property
    def body(self) -> Literal["rigid", "curve", "soft", "tool", "nothing"]: ...
    @property
    def time(self) -> float:
        """The moment, s."""

    @property
    def steps(self) -> int:
        """Steps so far."""

    @property
    def at_rest(self) -> bool: ...
    @property
    def contact_solve(self) -> tuple[Literal["kept", "near", "polished", "interior"], int, float, float] | None:
        """Of the leader of a cluster, how its last step was solved: level, factors, by how much the answers miss the laws, m/s,
        and the deepest overlap, m."""

    @property
    def energy(self) -> float:
        """Kinetic, elastic and that of gravity, J."""

    @property
    def positions(self) -> Array:
        """(n, 3), m: the nodes of a deformable, the centre of mass of a rigid body or the tip of a tool."""

    @property
    def velocities(self) -> Array:
        """(n, 3), m/s, of the same points."""

    @property
    def nodes(self) -> Array:
        """(n, 3), m: of a soft body the nodes of the cage or lattice that carries its vertices, or these where nothing does."""

    @property
    def node_velocities(self) -> Array:
        """(n, 3), m/s, of the same nodes."""

    @property
    def rotation(self) -> Array:
        """(4,): of a rigid body or tool, from its axes to the world's. Others raise `AttributeError`."""

    @property
    def spin(self) -> Array:
        """(3,), rad/s, world axes: of a rigid body or tool."""

    @property
    def frames(self) -> Array:
        """(n - 1, 4): of a tube, the rotations of its segments, whose z is along it."""

    @property
    def arc(self) -> Array:
        """(n,), m: of a tube, the rest lengths from its start to its nodes."""

    @property
    def contact_wrench(self) -> Array:
        """(6,), N and N m, world axes: the wrench of contacts on a rigid body or tool, about its centre of mass, in the mean of its last step."""

    @property
    def radii(self) -> Array:
        """(n,), m: of a tube, the outer radius at each node."""

    def point(self, **keywords: Unpack[_Point]) -> tuple[Array, Array]:
        """Position, m, and velocity, m/s, of a material point, (3,) each."""

@final
class States:
    """The newest states of all objects, in one call. It never changes; its arrays are read-only."""

    @property
    def names(self) -> list[str]:
        """Of the n objects."""

    @property
    def times(self) -> Array:
        """(n,), s: the moment of each."""

    @property
    def starts(self) -> NDArray[np.int64]:
        """(n + 1,): `positions[starts[i]:starts[i + 1]]` are object i's, one point of a rigid body or tool."""

    @property
    def positions(self) -> Array:
        """(m, 3), m: the nodes of deformables, the centres of mass of rigid bodies and the tips of tools."""

    @property
    def velocities(self) -> Array:
        """(m, 3), m/s, of the same points."""

    @property
    def rotations(self) -> Array:
        """(n, 4): from the axes of each rigid body or tool to the world's; not numbers for a deformable."""

    @property
    def spins(self) -> Array:
        """(n, 3), rad/s, world axes, likewise."""

@final
class Events:
    """Listens to a world. An object keeps its newest 128 events until they are drained; of a world elsewhere all objects together 4096."""

    def drain(self) -> list[Event]:
        """The events since the last call, oldest first."""

    @property
    def lost(self) -> int:
        """How many were overwritten before they were drained."""

@final
class Export:
    """Writes moments of a world; in a `with` block the files are complete at the end."""

    def write(self) -> None:
        """Writes the world as it is now. `OSError` where a file cannot be written, `RuntimeError` after `close`."""

    def close(self) -> None:
        """Completes the files."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *_raised: Any) -> None: ...

@final
class Event:
    """Something that happened."""

    @property
    def kind(
        self,
    ) -> Literal[
        "contact_began",
        "contact_ended",
        "rests",
        "wakes",
        "failed",
        "stalled",
        "gone",
        "joined",
        "left",
        "attachment_gave",
        "rate_missed",
        "under_resolved",
        "carved",
        "rewound",
        "unknown",
    ]: ...
    @property
    def object(self) -> Object:
        """The object that it happened to."""

    @property
    def time(self) -> float:
        """The end of the step in which it happened, s."""

    @property
    def other(self) -> str | None:
        """Of a contact the object or solid that it touches; of one that joined a cluster its leader."""

    @property
    def point(self) -> Array | None:
        """Of a contact the place that bore most, m."""

    @property
    def normal(self) -> Array | None:
        """Of a contact the normal there, towards the object."""

    @property
    def force(self) -> Array | None:
        """Of a contact the greatest force on the object in the mean of a step so far, N, world axes."""

@final
class Contact:
    """A contact as it is now."""

    @property
    def other(self) -> str: ...
    @property
    def since(self) -> float:
        """When it began, s."""

    @property
    def point(self) -> Array:
        """The place that bears most, m."""

    @property
    def normal(self) -> Array:
        """The normal there, towards the object."""

    @property
    def force(self) -> Array:
        """On the object, in the mean of the last step, N, world axes."""

    @property
    def depth(self) -> float:
        """The deepest overlap, m."""

@final
class Hit:
    """A hit of a ray or a search."""

    @property
    def name(self) -> str: ...
    @property
    def point(self) -> Array:
        """Of its surface, m."""

    @property
    def normal(self) -> Array:
        """Of its surface there, outwards."""

    @property
    def distance(self) -> float:
        """m; negative within what overlaps."""

@final
class Rollout:
    """The results of many worlds."""

    @property
    def positions(self) -> dict[str, Array]:
        """By observed object (worlds, steps, n, 3), m, after each step."""

    @property
    def velocities(self) -> dict[str, Array]:
        """The same, m/s."""

    @property
    def hashes(self) -> NDArray[np.uint64]:
        """(worlds,): as `World.hash`, at the end."""

def connect(
    endpoint: str, *, scene: Scene | None = None, identity: str | PathLike[str] | None = None, insecure_lan: bool = False
) -> RemoteWorld:
    """The world that is served at `endpoint`, such as `"tcp/127.0.0.1:7447"`: by `metachron host`, or by a program. Of the scene `scene`, if that
    is given. Beyond this machine, at `"tls/..."`, as the `identity` in a file of `metachron identity new`; or at `"tcp/..."` with `insecure_lan`,
    where anybody on the network may listen and speak.

    Raises `ValueError` for an endpoint or a file that cannot be, another version of the program and another scene, and `ConnectionError` where
    no world is served.
    """

def replay(path: str | PathLike[str], scene: Scene | None = None, *, until: float | None = None) -> World:
    """A world on one thread that does again what a recording says, as far as time is let pass, and no further than `until`, s; it takes no commands.

    `scene` is the recorded scene, unless that was read from TOML: then the recording has it. Raises `OSError`, and `ValueError` for a file
    that is no recording of this version, or is of another scene.
    """

def rollout(scene: Scene, on: str, actions: ArrayLike, **keywords: Unpack[_Rollout]) -> Rollout:
    """Plays a world in lockstep at the free pace for each row of `actions`: forces on one object, N, (worlds, steps, 3).

    `step` is required. A world is the same, bit for bit, on any number of threads.
    """
