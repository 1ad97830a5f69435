"""Scenes and states go to other processes and come back as they were; what is printed names what it is of."""

import copy
import inspect
import pickle
from pathlib import Path

import metachron as mc
import numpy as np
import pytest
import scenes


def hinged() -> mc.Scene:
    """A part of every kind that a scene can have."""
    scene = scenes.tube().fixed("ramp", mc.Box([0.1, 0.1, 0.1], at=[3.0, 0.0, 0.0], rotation=[0.0, 1.0, 0.0, 1.0]))
    scene.add("door", mc.Box([0.1, 0.01, 0.2], at=[1.0, 0.0, 1.0]))
    scene.add("jelly", mc.SoftBox((0.1, 0.1, 0.1), (2, 2, 2), at=[2.0, 0.0, 0.5]))
    scene.joint("hinge", mc.Revolute([0.0, 0.0, 1.0], at=[1.0, 0.0, 1.0], range=(-1.0, 1.0)), "door")
    return scene.sensor("angle", mc.JointPosition("hinge"))


def played(scene: mc.Scene) -> int:
    """The hash of a world of it after a while."""
    world = scene.start()
    world.advance(0.2)
    return world.hash()


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda scene: pickle.loads(pickle.dumps(scene))])
def test_a_scene_that_was_pickled_or_copied_plays_the_same(again) -> None:  # type: ignore[no-untyped-def]
    scene = hinged()
    other = again(scene)
    assert played(other) == played(scene)
    other.add("more", mc.Ball(0.1, at=[0.0, 5.0, 0.0]))
    assert repr(other) == "<Scene of [gut, door, jelly, more]>"
    assert repr(scene) == "<Scene of [gut, door, jelly]>", "a copy is its own"


def test_a_scene_from_a_text_or_a_file_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scenes.BALL)
    for scene in [mc.Scene.from_toml(scenes.BALL), mc.Scene.from_toml(file), mc.Scene.from_toml("stack")]:
        assert played(pickle.loads(pickle.dumps(scene))) == played(scene)


def test_a_state_that_was_pickled_or_copied_is_the_same_and_can_be_set() -> None:
    world = hinged().start()
    world.advance(0.1)
    for name in ["gut", "door", "jelly"]:
        state = world.state(name)
        for other in [pickle.loads(pickle.dumps(state)), copy.copy(state), copy.deepcopy(state)]:
            assert (other.time, other.steps, other.energy) == (state.time, state.steps, state.energy)
            assert np.array_equal(other.positions, state.positions) and np.array_equal(other.velocities, state.velocities)
            world.set_state(name, other)


def test_a_pickle_of_another_format_or_of_nothing_is_refused() -> None:
    state = scenes.falling().start().state("ball")
    whole = pickle.dumps(state)
    begins = b"mcpk\x01"
    assert whole.count(begins) == 1
    for other, found in [(b"mcpk\x09", "format 9"), (b"0.5.0", "no format of metachron")]:
        with pytest.raises(ValueError, match=f"^the pickle has {found}; this version reads format 1$"):
            pickle.loads(whole.replace(begins, other))
    with pytest.raises(ValueError, match="the pickle is not read"):
        mc.State(b"")


def test_what_is_printed_names_what_it_is_of() -> None:
    world = scenes.bouncing().start()
    events = world.events()
    world.advance(0.5)
    began = events.drain()[0]
    assert began.force is not None
    assert str(began) == f'{began.time} s: "ball" begins to touch "floor" with {np.linalg.norm(began.force):.3f} N'
    assert repr(events) == "<Events, 0 lost>"
    assert repr(world.checkpoint()) == "<Checkpoint at 0.5 s>"
    rollout = mc.rollout(scenes.floating(), "ball", np.zeros((3, 1, 3)), step=0.01)
    assert repr(rollout) == "<Rollout of 3 worlds>"


def test_help_has_the_keywords_of_commands() -> None:
    for method in [mc.World.force, mc.World.torque, mc.World.spring]:
        keywords = inspect.signature(method).parameters
        assert {"arc", "local", "vertex", "key", "expires"} <= set(keywords), method
    assert {"stiffness", "damping"} <= set(inspect.signature(mc.World.spring).parameters)
    assert {"velocity", "spin", "expires"} <= set(inspect.signature(mc.World.pose).parameters)
    assert {"velocity", "position", "stiffness", "damping", "max_effort"} <= set(inspect.signature(mc.World.motor).parameters)
    assert {"step", "observe", "threads"} <= set(inspect.signature(mc.rollout).parameters)


def test_a_pace_can_be_set_later() -> None:
    world = mc.World.from_toml(scenes.SLOW)
    assert world.pace == "free"
    world.set_pace("real-time")
    world.advance(0.1)
    assert world.pace == "real-time" and world.dropped > 0.0
    world.set_pace(0.25)
    assert world.pace == "real-time"
    world.set_pace("free")
    assert world.pace == "free"
    with pytest.raises(ValueError, match="the factor of time is 1000; expected 0.001 to 100"):
        world.set_pace(1000.0)
    with pytest.raises(ValueError, match='there is no pace "slow"'):
        world.set_pace("slow")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match='expected "real-time", "free" or a number'):
        world.set_pace(None)  # type: ignore[arg-type]
