"""What is recorded is repeated to the bit."""

from pathlib import Path

import metachron as mc
import pytest
import scenes


def play(world: mc.World) -> None:
    """Does something to a world with a ball."""
    world.advance(0.2)
    world.force("ball", [0.5, 0.0, 0.0], expires=0.1)
    world.advance(0.2)
    world.add("box", mc.Box([0.05, 0.05, 0.05], at=[1.0, 0.0, 5.0]))
    world.add("jelly", mc.SoftBox((0.1, 0.1, 0.1), (2, 2, 2), at=[2.0, 0.0, 5.0]))
    world.advance(0.3)


def played(world: mc.World) -> mc.World:
    while world.replayed != 1.0:
        world.advance(0.05)
    return world


def test_a_replay_ends_with_the_same_bits(tmp_path: Path) -> None:
    scene, file = scenes.falling(), tmp_path / "run.rec"
    world = scene.start()
    world.record(file)
    play(world)
    assert world.end_recording()
    assert not world.end_recording()
    assert world.replayed is None
    assert played(mc.replay(file, scene)).hash() == world.hash()
    half = mc.replay(file, scene, until=0.3)
    half.advance(1.0)
    assert half.time == pytest.approx(0.3, abs=0.02)
    with pytest.raises(ValueError, match="recording"):
        half.force("ball", [0.0, 0.0, 1.0])


def test_a_scene_from_toml_is_in_its_recording(tmp_path: Path) -> None:
    world = mc.World.from_toml("stack")
    world.record(tmp_path / "run.rec")
    world.advance(0.3)
    # what is refused does not empty a file
    (tmp_path / "other").write_text("kept")
    with pytest.raises(RuntimeError, match="being recorded already"):
        world.record(tmp_path / "other")
    assert (tmp_path / "other").read_text() == "kept"
    world.stop()
    assert played(mc.replay(tmp_path / "run.rec")).hash() == world.hash()


def test_what_cannot_be_recorded_or_repeated_says_why(tmp_path: Path) -> None:
    file = tmp_path / "run.rec"
    world = scenes.falling().start()
    with pytest.raises(OSError, match="no.run.rec"):
        world.record(tmp_path / "no" / "run.rec")
    world.record(file)
    world.advance(0.1)
    world.stop()
    with pytest.raises(ValueError, match="built of parts"):
        mc.replay(file)
    with pytest.raises(ValueError, match="moving objects"):
        mc.replay(file, mc.Scene())
    file.write_bytes(b"something else")
    with pytest.raises(ValueError, match="no recording"):
        mc.replay(file, scenes.falling())
    with pytest.raises(OSError, match="none.rec"):
        mc.replay(tmp_path / "none.rec")
