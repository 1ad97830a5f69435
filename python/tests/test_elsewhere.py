"""A world that `metachron host` serves is called as one that runs here."""

import os
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import metachron as mc
import numpy as np
import pytest
import scenes

try:
    mc.connect("nowhere")
except RuntimeError as error:
    if "feature `hosts`" in str(error):
        pytest.skip(str(error), allow_module_level=True)
    raise
except ValueError:
    pass

SCENE = scenes.BALL + "position_m = [0.0, 0.0, 1.0]\n"


@pytest.fixture
def endpoint(tmp_path: Path) -> Iterator[str]:
    """Where a host serves the scene in lockstep; `METACHRON` names the program."""
    path = tmp_path / "scene.toml"
    path.write_text("executor = 'lockstep'\n" + SCENE)
    with socket.create_server(("127.0.0.1", 0)) as free:
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    program = os.environ.get("METACHRON", "metachron")
    command = [program, "host", str(path), "--paused", "--json", "--listen", endpoint]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as host:
        assert host.stdout is not None
        try:
            assert host.stdout.readline().startswith(b"{")
            yield endpoint
        finally:
            host.kill()


def test_a_world_elsewhere_answers_as_one_here(endpoint: str) -> None:
    here, there = mc.World.from_toml(SCENE), mc.connect(endpoint)
    assert isinstance(there, mc.WorldCalls) and isinstance(here, mc.WorldCalls)
    events = there.events(contacts=False)
    for world in (here, there):
        world.force("ball", [1.0, 0.0, 0.0], expires=0.05)
        world.advance(0.2)
    assert there.hash() == here.hash() and there.time == here.time
    np.testing.assert_array_equal(there.state("ball").positions, here.state("ball").positions)
    mark, end = there.checkpoint(), there.hash()
    second = there.add("second", mc.Ball(0.05, at=[1.0, 0.0, 1.0]))
    there.advance(0.1)
    assert [thing.name for thing in there.objects] == ["ball", "second"] and there.state(second).steps > 0
    there.restore(mark)
    assert there.hash() == end and len(there.states().names) == 1
    assert "rewound" in {event.kind for event in events.drain()} and events.lost == 0
    assert not there.is_silent


def test_errors_elsewhere_are_those_here(endpoint: str) -> None:
    here, there = mc.World.from_toml(SCENE), mc.connect(endpoint)
    for world in (here, there):
        with pytest.raises(KeyError, match="bal"):
            world.state("bal")
        with pytest.raises(ValueError, match="ball"):
            world.carve("ball", [0, 0, 0], 0.1)
        with pytest.raises(ValueError, match="already"):
            world.add("ball", mc.Ball(0.1))
    with pytest.raises(RuntimeError, match="another world"):
        there.state(here.object("ball"))
    with pytest.raises(ValueError, match="no endpoint"):
        mc.connect("smoke/127.0.0.1:1")
    with pytest.raises(ValueError, match="tls/ and an identity"):
        mc.connect("tls/127.0.0.1:1")
    with pytest.raises(ValueError, match=r"none\.pem"):
        mc.connect("tls/127.0.0.1:1", identity="none.pem")
    with pytest.raises(ConnectionError):
        mc.connect("tcp/127.0.0.1:1")
    with pytest.raises(ValueError, match="of the scene"):
        mc.connect(endpoint, scene=mc.Scene().add("other", mc.Ball(0.2)))
    mc.connect(endpoint, scene=mc.Scene.from_toml(SCENE))
