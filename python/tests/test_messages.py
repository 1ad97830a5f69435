"""What cannot be is told in a sentence that names it."""

from collections.abc import Callable
from pathlib import Path

import metachron as mc
import numpy as np
import pytest
import scenes

TOML = scenes.BALL + "mass_kg = 2.0\n"


def test_a_scene_is_read_from_a_text_a_path_and_a_name(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(TOML)
    worlds = [mc.World.from_toml(TOML), mc.World.from_toml(file), mc.World.from_toml(str(file))]
    assert len({world.hash() for world in worlds}) == 1
    assert mc.World.from_toml("stack").time == 0.0


def test_a_wrong_scene_is_told_by_line_and_column() -> None:
    with pytest.raises(ValueError, match=r"line 6, column 12: .*`radius_m`") as error:
        mc.Scene.from_toml(TOML.replace("0.1", "-1"))
    assert "given as text" in str(error.value)
    with pytest.raises(ValueError, match="line 1, column"):
        mc.Scene.from_toml("format = = 1\n")
    with pytest.raises(ValueError, match="no built-in scene `tubes`.*did you mean `tube`"):
        mc.Scene.from_toml("tubes")


def wrong(build: Callable[[], mc.Scene], message: str) -> None:
    """The scene cannot be built, and says so."""
    with pytest.raises(ValueError, match=message):
        build().start()


def test_parts_that_cannot_be_are_named() -> None:
    scene = mc.Scene
    wrong(lambda: scene().add("a", mc.Ball(-1.0)), '"a".*radius')
    wrong(lambda: scene().add("a", mc.Ball(0.1)).add("a", mc.Ball(0.1)), '"a"')
    wrong(lambda: scene().add("a", mc.Ball(0.1, rate=0.0)), '"a" is 0 Hz; expected 1 to 100000 Hz')
    wrong(lambda: scene().add("a", mc.Tube([[0.0, 0.0, 0.0]])), '"a"')
    wrong(lambda: scene().add("a", mc.Plane()), "Plane does not move")  # type: ignore[arg-type]
    wrong(lambda: scene().fixed("a", mc.Ball(0.1, mass=2.0)), "no mass")
    wrong(lambda: scene().fixed("a", mc.Ball(0.1, gravity_scale=2.0)), "no gravity_scale")
    wrong(lambda: scene().fixed("a", mc.Plane(friction=-3.0)), '"a": friction is -3; expected a number from 0 to 1000')
    wrong(lambda: scene().add("a", mc.Tube([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], segments=-3)), "field 'segments'")
    wrong(lambda: scene().joint("j", mc.Fixed(at=[0.0, 0.0, 0.0]), "a"), '"a"')
    wrong(lambda: scene().add("a", mc.Ball(0.1, rotation=[0.0, 0.0, 0.0, 0.0])), "is no rotation")
    wrong(lambda: mc.Scene.from_toml(TOML).add("b", mc.Ball(0.1)), "complete")
    with pytest.raises(ValueError, match="expected one of auto, threads, pool, lockstep"):
        scenes.floating().start("gpu")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match='there is no end of a tube "middle"; expected one of start, end'):
        scene().add("a", mc.Tube([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], clamp=["middle"]))  # type: ignore[list-item]
    with pytest.raises(AttributeError, match="metachron.Weld is named metachron.Fixed"):
        getattr(mc, "Weld")
    with pytest.raises(ValueError, match="there is no pace \"slow\"; expected one of real-time, free"):
        scenes.floating().start("lockstep", "slow")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="field 'at': expected three numbers"):
        scene().add("a", mc.Ball(0.1, at=[1.0, 2.0]))
    with pytest.raises(TypeError, match="got a dict"):
        scene().add("a", {})  # type: ignore[arg-type]


def test_commands_that_cannot_be_say_why() -> None:
    world = scenes.floating().start()
    with pytest.raises(KeyError, match='no moving object "bell"; its moving objects are ball'):
        world.state("bell")
    with pytest.raises(ValueError, match="finite"):
        world.force("ball", [np.nan, 0.0, 0.0])
    with pytest.raises(ValueError, match="Arc.*Local"):
        world.force("ball", [1.0, 0.0, 0.0], arc=0.1)
    with pytest.raises(ValueError, match=r'"ball" \(model "rigid"\) takes no poses; it takes springs, forces'):
        world.pose("ball", [1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="takes no carving"):
        world.carve("ball", [0.0, 0.0, 0.0], 0.1)
    with pytest.raises(ValueError, match="keys are 0 to 7"):
        world.force("ball", [1.0, 0.0, 0.0], key=8)
    with pytest.raises(ValueError, match="expires is -1.0 s"):
        world.force("ball", [1.0, 0.0, 0.0], expires=-1.0)
    with pytest.raises(TypeError, match="no keyword argument 'until'.*expires"):
        world.force("ball", [1.0, 0.0, 0.0], until=2.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="three numbers"):
        world.force("ball", [1.0, 0.0])
    with pytest.raises(TypeError, match="one of arc, local and vertex"):
        world.force("ball", [1.0, 0.0, 0.0], arc=0.1, vertex=1)
    with pytest.raises(ValueError, match="needs a stiffness"):
        world.spring("ball", [1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="advance by is -1.0 s"):
        world.advance(-1.0)
    with pytest.raises(ValueError, match="same would be written twice"):
        world.export(mcap="same", perfetto="same")
    with pytest.raises(ValueError, match="argument 'key': the number is out of range"):
        world.force("ball", [0.0, 0.0, 1.0], key=-1)
    with pytest.raises(ValueError, match="ray|cast"):
        world.cast_ray([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.0)
    with pytest.raises(ValueError, match="lockstep"):
        world.run()
    with pytest.raises(ValueError, match="above is NaN"):
        world.events(above=np.nan)
    with pytest.raises(AttributeError, match="frames"):
        _ = world.state("ball").frames
    world.advance(0.1)
    assert (world.state("ball").velocities == 0.0).all()


def test_an_object_that_fails_says_why() -> None:
    world = scenes.floating().start()
    assert world.fault("ball") is None
    failed = world.events(contacts=False)
    world.force("ball", [1e10, 0.0, 0.0])
    world.advance(0.1)
    reason = world.fault("ball")
    assert reason is not None and reason != ""
    assert [event.kind for event in failed.drain()] == ["failed"]


def test_an_object_of_another_world_is_refused() -> None:
    world, other = (scenes.floating().start() for _ in range(2))
    with pytest.raises(RuntimeError, match="another world"):
        world.force(other.object("ball"), [1.0, 0.0, 0.0])


def test_a_stopped_world_stays_readable_and_takes_nothing_up() -> None:
    world = scenes.falling().start()
    world.advance(0.1)
    world.stop()
    height = world.state("ball").positions[0, 2]
    world.advance(1.0)
    assert world.state("ball").positions[0, 2] == height
    with pytest.raises(RuntimeError, match="stopped"):
        world.add("more", mc.Ball(0.1))
    with pytest.raises(RuntimeError, match="stopped"):
        world.force("ball", [1.0, 0.0, 0.0])
    with pytest.raises(RuntimeError, match="stopped"):
        world.set_state("ball", world.state("ball"))
