"""Soft bodies of a scene that is built of parts."""

from pathlib import Path

import metachron as mc
import numpy as np
import pytest
import scenes

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_soft_parts_fall_as_bodies_do(tmp_path: Path) -> None:
    file = tmp_path / "tetrahedron.obj"
    file.write_text(TETRAHEDRON)
    scene = mc.Scene()
    scene.add("box", mc.SoftBox((0.1, 0.2, 0.3), (2, 2, 2), at=[0.0, 0.0, 5.0]))
    scene.add("ball", mc.SoftBall(0.1, 4, at=[1.0, 0.0, 5.0], law="neo-hookean", density=500.0))
    scene.add("sheet", mc.Sheet((0.4, 0.2), 0.002, (4, 2), at=[2.0, 0.0, 5.0], friction=0.5))
    scene.add("rope", mc.Rope([[3.0, 0.0, 5.0], [3.5, 0.0, 5.0]], 0.01, 5))
    scene.add("mesh", mc.SoftMesh(file, (0.1, 0.2), 0.3, at=[4.0, 0.0, 5.0], velocity=[0.0, 0.0, 1.0]))
    world = scene.start()
    starts = {name: world.state(name).positions[:, 2].mean() for name in ["box", "ball", "sheet", "rope", "mesh"]}
    world.advance(0.5)
    for name, start in starts.items():
        state = world.state(name)
        up = 1.0 if name == "mesh" else 0.0
        fallen = start - state.positions[:, 2].mean()
        # implicit steps of 1/240 s are ahead of the parabola by g t dt / 2
        assert fallen == pytest.approx(0.5 * 9.81 * state.time**2 - up * state.time, abs=0.011), name


def test_a_held_side_stays_and_the_rest_sags() -> None:
    stiff, soft = (
        mc.SoftBox((0.3, 0.05, 0.05), (6, 1, 1), young=young, poisson=0.3, damping=(1.0, 0.01), hold=["left"])
        for young in (1e7, 1e5)
    )
    drops = []
    for beam in (stiff, soft):
        world = mc.Scene().add("beam", beam).start()
        start = world.state("beam").positions
        world.advance(0.5)
        now = world.state("beam").positions
        held = start[:, 0] == start[:, 0].min()
        assert held.any()
        assert np.array_equal(now[held], start[held])
        drops.append(float((start - now)[:, 2].max()))
    assert 0.0 < 10 * drops[0] < drops[1]


def test_soft_parts_that_cannot_be_are_named(tmp_path: Path) -> None:
    def build(part: mc.Sheet | mc.SoftBox | mc.SoftMesh) -> None:
        mc.Scene().add("a", part).start()

    with pytest.raises(ValueError, match="no side 'up'|no side \"up\""):
        build(mc.SoftBox((1.0, 1.0, 1.0), (1, 1, 1), hold=["up"]))  # type: ignore[list-item]
    with pytest.raises(ValueError, match="needs an exponent"):
        build(mc.SoftBox((1.0, 1.0, 1.0), (1, 1, 1), law="ogden"))
    with pytest.raises(ValueError, match="no law"):
        build(mc.SoftBox((1.0, 1.0, 1.0), (1, 1, 1), law="rubber"))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match='"a"'):
        build(mc.SoftBox((1.0, 1.0, 1.0), (1, 1, 1), young=-1.0))
    with pytest.raises(ValueError, match='"a"'):
        build(mc.Sheet((1.0, -1.0), 0.01, (2, 2)))
    with pytest.raises(ValueError, match="field 'size'"):
        build(mc.Sheet((1.0, 1.0, 1.0), 0.01, (2, 2)))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="none.obj.*cannot be used"):
        build(mc.SoftMesh(tmp_path / "none.obj", (0.1, 0.2)))


def test_a_soft_body_is_put_back_node_by_node() -> None:
    cloth = mc.Sheet((0.4, 0.2), 0.002, (8, 4), eps=(0.1, 0.2), young=1e6, hold=["left"], rate=250)
    world = mc.Scene().add("cloth", cloth).start()
    world.advance(0.1)
    before = world.state("cloth")
    assert before.nodes.shape == before.node_velocities.shape == (15, 3)
    ends = []
    for nodes, velocities in [(before.nodes, before.node_velocities)] * 2:
        world.set_nodes("cloth", nodes, velocities)
        world.advance(0.1)
        ends.append(world.state("cloth").positions)
    assert (ends[0] == ends[1]).all() and not np.allclose(ends[0], before.positions, atol=1e-4)
    world.set_state("cloth", before)
    world.advance(0.1)
    assert (world.state("cloth").positions == ends[0]).all()
    with pytest.raises(ValueError, match=f"3 positions of nodes, 3 velocities of nodes; expected {len(before.nodes)}"):
        world.set_nodes("cloth", np.zeros((3, 3)))
    with pytest.raises(AttributeError, match="soft bodies have them"):
        _ = scenes.floating().start().state("ball").nodes
