"""Files of moments, opened by readers that are not ours."""

import json
import struct
from pathlib import Path

import meshio
import metachron as mc
import numpy as np
import pytest
import scenes
from mcap.reader import make_reader

MOMENTS = 12


def write(folder: Path) -> list[float]:
    """Heights of the falling ball at the moments written."""
    heights = []
    with scenes.falling().start() as world, world.export(mcap=folder / "run.mcap", vtk=folder / "vtk") as export:
        for _ in range(MOMENTS):
            world.advance(0.05)
            export.write()
            heights.append(float(world.state("ball").positions[0, 2]))
    return heights


def test_mcap_reads_what_was_written(tmp_path: Path) -> None:
    heights = write(tmp_path)
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file)
        messages = [(channel.topic, message.log_time, json.loads(message.data)) for _, channel, message in reader.iter_messages()]
    transforms = [(time, body) for topic, time, body in messages if topic == "/tf"]
    assert [body["translation"]["z"] for _, body in transforms] == heights
    assert [time for time, _ in transforms] == [50_000_000 * (k + 1) for k in range(MOMENTS)]
    states = [body for topic, _, body in messages if topic == "/state"]
    assert {state["name"] for state in states} == {"ball"}
    assert states[-1]["snapshot"]["steps"] > states[0]["snapshot"]["steps"] > 0


def test_meshio_reads_the_surfaces(tmp_path: Path) -> None:
    heights = write(tmp_path)
    for k in (0, MOMENTS - 1):
        mesh = meshio.read(tmp_path / "vtk" / f"{k:06}.vtu")
        points, triangles = mesh.points, mesh.cells_dict["triangle"]
        assert triangles.max() < len(points)
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        assert middle[2] == pytest.approx(heights[k], abs=1e-9)
        corners = points[triangles]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        radius = np.ptp(points[:, 2]) / 2
        assert volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.06)
        assert set(mesh.cell_data) == {"object", "eps_m", "residual_m"}
        assert np.isnan(mesh.point_data["von_mises_pa"]).all()
        # all points of a body that does not turn move alike
        assert np.ptp(mesh.point_data["velocity"], axis=0) == pytest.approx([0.0, 0.0, 0.0])


def test_a_trace_has_every_step(tmp_path: Path) -> None:
    file = tmp_path / "trace.json"
    with scenes.falling().start() as world, world.export(perfetto=file) as export:
        for _ in range(MOMENTS):
            world.advance(0.05)
            export.write()
        end = world.state("ball").time
    events = json.loads(file.read_text())
    lanes = {event["tid"]: event["args"]["name"] for event in events if event["name"] == "thread_name" and event["pid"] == 2}
    assert list(lanes.values()) == ["ball"]
    steps = [event for event in events if event["ph"] == "X"]
    assert {event["name"] for event in steps} == {"step"}
    assert sum(step["args"]["dt_ms"] for step in steps) == pytest.approx(1e3 * end)
    assert all(left["ts"] + left["dur"] <= right["ts"] for left, right in zip(steps, steps[1:], strict=False))


def test_glb_has_its_tables(tmp_path: Path) -> None:
    world = scenes.tube().start()
    world.advance(0.05)
    world.write_glb(tmp_path / "now.glb")
    data = (tmp_path / "now.glb").read_bytes()
    magic, version, length, tables_length, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    tables = json.loads(data[20 : 20 + tables_length])
    assert [node["name"] for node in tables["nodes"]] == ["fixed", "gut", "metachron"]
    top = max(tables["accessors"][0]["max"][2], tables["accessors"][3]["max"][2])
    gut = world.state("gut").positions
    assert top == pytest.approx(gut[:, 2].max() + 0.015, abs=1e-3)
    with pytest.raises(OSError, match="cannot be written"):
        world.write_glb(tmp_path / "no" / "now.glb")


def test_an_animation_plays_what_was_written(tmp_path: Path) -> None:
    heights = []
    with scenes.falling().start() as world, world.export(glb=tmp_path / "run.glb") as export:
        for _ in range(MOMENTS):
            world.advance(0.05)
            export.write()
            heights.append(float(world.state("ball").positions[0, 2]))
    data = (tmp_path / "run.glb").read_bytes()
    (tables_length,) = struct.unpack_from("<I", data, 12)
    tables, numbers = json.loads(data[20 : 20 + tables_length]), data[28 + tables_length :]

    def values(accessor: int) -> np.ndarray:
        table = tables["accessors"][accessor]
        view = tables["bufferViews"][table["bufferView"]]
        return np.frombuffer(numbers, np.float32, view["byteLength"] // 4, view["byteOffset"]).reshape(table["count"], -1)

    animation = tables["animations"][0]
    channels = {channel["target"]["path"]: animation["samplers"][channel["sampler"]] for channel in animation["channels"]}
    assert values(channels["translation"]["input"])[:, 0] == pytest.approx([0.05 * (k + 1) for k in range(MOMENTS)])
    assert values(channels["translation"]["output"])[:, 2] == pytest.approx(heights)


def test_mcap_and_vtk_have_contacts(tmp_path: Path) -> None:
    scene = mc.Scene().fixed("floor", mc.Plane()).add("ball", mc.Ball(0.05, mass=0.2, at=[0.0, 0.0, 0.05]))
    with scene.start() as world, world.export(mcap=tmp_path / "run.mcap", vtk=tmp_path / "vtk") as export:
        world.advance(0.2)
        export.write()
    with (tmp_path / "run.mcap").open("rb") as file:
        messages = [json.loads(message.data) for _, channel, message in make_reader(file).iter_messages() if channel.topic == "/contacts"]
    (contact,) = messages[-1]["contacts"]
    assert (contact["object"], contact["with"]) == ("ball", "floor")
    assert contact["force"]["z"] == pytest.approx(0.2 * 9.81, rel=1e-3)
    assert b"floor" in (tmp_path / "vtk" / "contacts000000.vtu").read_bytes()


def test_bad_files_are_told(tmp_path: Path) -> None:
    write(tmp_path)
    world = scenes.falling().start()
    with pytest.raises(ValueError, match="nothing would be written"):
        world.export()
    with pytest.raises(ValueError, match="would overwrite"):
        world.export(vtk=tmp_path / "vtk")
    with pytest.raises(OSError, match="cannot be written"):
        world.export(mcap=tmp_path / "no" / "run.mcap")
    export = world.export(mcap=tmp_path / "again.mcap")
    export.close()
    with pytest.raises(RuntimeError, match="complete"):
        export.write()
