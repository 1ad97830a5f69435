"""Worlds do what mechanics says, and their states are what they were."""

import gc
import os
import signal
import threading
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import metachron as mc
import numpy as np
import pytest
import scenes


def test_a_ball_falls_as_g_t_squared_over_two() -> None:
    world = scenes.falling().start()
    world.advance(1.0)
    state = world.state("ball")
    assert world.time == 1.0
    assert state.positions[0] == pytest.approx([0.0, 0.0, 10.0 - 0.5 * 9.81 * state.time**2], abs=1e-9)
    assert state.velocities[0, 2] == pytest.approx(-9.81 * state.time)
    # 240 steps a second
    assert abs(state.time - 1.0) <= 1.0 / 240.0


@pytest.mark.parametrize("executor", ["threads", "pool"])
def test_a_ball_falls_in_real_time_too(executor: Literal["threads", "pool"]) -> None:
    with scenes.falling().start(executor) as world:
        world.advance(0.1)
        state = world.state("ball")
        assert state.time >= 0.1
        assert state.positions[0, 2] == pytest.approx(10.0 - 0.5 * 9.81 * state.time**2)


def test_a_force_gives_f_t_over_m_for_as_long_as_it_was_sent_for() -> None:
    world = scenes.floating().start()
    ball = world.object("ball")
    world.force(ball, [2.0, 0.0, 0.0], expires=0.055)
    world.force("ball", np.array([0.0, 1.0, 0.0], dtype=np.float32), key=1)
    world.torque(ball, (0.0, 0.0, 0.01), key=2, expires=0.1)
    world.advance(0.2)
    world.force(ball, None, key=1)
    world.advance(0.3)
    state = world.state(ball)
    assert state.velocities[0] == pytest.approx([2.0 * 0.055 / 0.5, 1.0 * 0.2 / 0.5, 0.0], abs=0.02)
    assert state.velocities[0, 0] == pytest.approx(0.22, abs=1e-9)
    # I = 2/5 m r2
    assert state.spin == pytest.approx([0.0, 0.0, 0.01 * 0.1 / 0.002], abs=1e-9)


def test_impulses_springs_and_moves_reach_the_point_that_they_were_sent_to() -> None:
    world = scenes.floating().start()
    world.impulse("ball", [0.0, 0.0, 0.1], local=[0.0, 0.1, 0.0])
    world.advance(0.1)
    state = world.state("ball")
    assert state.velocities[0, 2] == pytest.approx(0.2, abs=1e-9)
    assert state.spin[0] == pytest.approx(0.1 * 0.1 / 0.002, abs=1e-6)
    half = np.sqrt(0.5)
    world.teleport("ball", [1.0, 2.0, 3.0], [0.0, 0.0, half, half])
    world.velocity("ball", [0.0, 0.0, 0.0])
    world.advance(0.1)
    position, velocity = world.state("ball").point(local=[0.1, 0.0, 0.0])
    assert position == pytest.approx([1.0, 2.1, 3.0], abs=1e-9)
    assert velocity == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    world.spring("ball", [1.0, 2.0, 4.0], stiffness=50.0, damping=10.0)
    world.advance(3.0)
    assert world.state("ball").positions[0] == pytest.approx([1.0, 2.0, 4.0], abs=1e-4)


def test_a_force_on_a_tube_lifts_it_where_it_is_told() -> None:
    world = scenes.tube().start()
    world.advance(0.5)
    sunk = world.state("gut").point(arc=0.3)[0][2]
    world.force("gut", [0.0, 0.0, 3.0], arc=0.3)
    world.advance(0.5)
    state = world.state("gut")
    assert state.point(arc=0.3)[0][2] > sunk
    shapes = [a.shape for a in (state.positions, state.velocities, state.frames, state.arc, state.radii)]
    assert shapes == [(21, 3), (21, 3), (20, 4), (21,), (21,)]
    assert state.arc[-1] == pytest.approx(0.6)


def test_a_motor_turns_its_hinge() -> None:
    wheel = mc.Box([0.2, 0.2, 0.02])
    scene = mc.Scene(gravity=[0.0, 0.0, 0.0]).add("wheel", wheel)
    world = scene.joint("axle", mc.Revolute([0.0, 0.0, 1.0], at=[0.0, 0.0, 0.0]), "wheel").start()
    # of the world relative to the wheel
    world.motor("axle", velocity=-3.0)
    world.advance(1.0)
    assert world.state("wheel").spin[2] == pytest.approx(3.0, abs=1e-6)
    world.motor("axle", position=-1.0, stiffness=20.0, damping=2.0)
    world.advance(3.0)
    half = world.state("wheel").rotation
    assert 2.0 * np.arctan2(half[2], half[3]) == pytest.approx(1.0, abs=1e-3)
    with pytest.raises(KeyError, match="axle"):
        world.motor("axis", velocity=1.0)


def test_a_pose_leads_a_plate_that_feels_its_load_and_a_state_is_set_back() -> None:
    scene = mc.Scene().add("plate", mc.Box([0.2, 0.2, 0.01], kinematic=True))
    world = scene.add("ball", mc.Ball(0.05, mass=0.3, at=[0.0, 0.0, 0.0601], restitution=0.0)).start()
    world.advance(0.5)
    before = world.state("ball")
    world.pose("plate", [0.0, 0.0, 0.0], velocity=[0.0, 0.0, 0.2], expires=1.0)
    world.advance(0.8)
    assert world.state("ball").velocities[0, 2] == pytest.approx(0.2, abs=1e-3)
    assert world.state("plate").contact_wrench[:3] == pytest.approx([0.0, 0.0, -0.3 * 9.81], abs=0.01)
    world.set_state("ball", before)
    world.advance(0.01)
    assert world.state("ball").positions[0] == pytest.approx(before.positions[0], abs=0.01)
    with pytest.raises(ValueError, match="takes no other states"):
        world.set_state("plate", before)
    with pytest.raises(KeyError, match="no sensor"):
        world.sensor("nose")


def test_every_bounce_is_told() -> None:
    world = scenes.bouncing().start()
    everything, loud = world.events(), world.events(states=False, above=30.0)
    world.advance(4.0)
    events = everything.drain()
    begun = [event for event in events if event.kind == "contact_began"]
    # it falls for sqrt(2 h/g), and each flight after is half as long as the one before
    fall = np.sqrt(2.0 * 0.5 / 9.81)
    for bounce, event in enumerate(begun[:4]):
        assert event.time == pytest.approx(fall + 2.0 * fall * (1.0 - 0.5**bounce), abs=2.0 / 240.0)
        assert (event.object.name, event.other) == ("ball", "floor")
        assert event.normal == pytest.approx([0.0, 0.0, 1.0])
    assert events[-1].kind == "rests" and events[-1].point is None
    assert everything.lost == 0 and everything.drain() == []
    assert 1 <= len([event for event in loud.drain() if event.kind == "contact_began"]) < len(begun)
    assert world.state("ball").at_rest
    (contact,) = world.contacts("ball")
    assert contact.other == "floor"
    assert contact.force == pytest.approx([0.0, 0.0, 0.2 * 9.81], rel=1e-3, abs=1e-3)


def test_rays_and_searches_find_what_is_there() -> None:
    world = scenes.bouncing().start()
    hit = world.cast_ray([0.3, 0.0, 2.0], [0.0, 0.0, -1.0], 5.0)
    assert hit is not None
    assert hit.name == "ball" and hit.distance == pytest.approx(1.4, abs=2e-5)
    below = world.nearest([0.0, 0.0, 0.1], 1.0)
    assert below is not None
    assert below.name == "floor" and below.distance == pytest.approx(0.1, abs=2e-5)
    assert world.cast_ray([0.3, 0.0, 2.0], [0.0, 0.0, 1.0], 5.0) is None


def test_objects_join_and_leave() -> None:
    world = scenes.bouncing().start()
    swab = world.add("swab", mc.Box([0.05] * 3, mass=0.1, at=[0.0, 0.0, 0.05]))
    world.advance(0.5)
    assert world.state(swab).positions[0, 2] == pytest.approx(0.05, abs=1e-3)
    world.remove("swab")
    world.advance(0.1)
    for call in [world.state, world.contacts, world.remove]:
        with pytest.raises(RuntimeError, match="removed"):
            call(swab)
    again = world.add("swab", mc.Ball(0.02, at=[0.0, 0.0, 1.0]))
    assert again != swab and hash(again) != hash(swab)


def test_states_never_change_and_outlive_their_world() -> None:
    world = scenes.tube().start()
    before = world.state("gut")
    positions = before.positions
    kept, time = positions.copy(), before.time
    world.advance(0.5)
    assert (world.state("gut").positions != kept).any()
    world.stop()
    del world
    assert (positions == kept).all() and (before.positions == kept).all() and before.time == time
    with pytest.raises(ValueError, match="read-only"):
        positions[0, 0] = 1.0
    with pytest.raises(ValueError, match="WRITEABLE"):
        positions.flags.writeable = True


def test_eight_threads_read_while_a_world_runs() -> None:
    with scenes.tube().start("threads") as world:
        done, steps = threading.Event(), [0] * 8

        def read(reader: int) -> None:
            newest = world.state("gut")
            while not done.is_set():
                state = world.state("gut")
                assert state.steps >= newest.steps
                assert np.isfinite(state.positions).all()
                newest, steps[reader] = state, state.steps

        readers = [threading.Thread(target=read, args=(reader,)) for reader in range(8)]
        for reader in readers:
            reader.start()
        world.advance(0.3)
        done.set()
        for reader in readers:
            reader.join()
    # a reader that raised has read nothing any more
    assert min(steps) > 0


def test_a_world_goes_on_by_itself_between_run_and_pause() -> None:
    with scenes.falling().start("threads") as world:
        ball = world.object("ball")
        world.run()
        while world.state(ball).steps < 5:
            pass
        world.pause()
        assert world.time > 0.0
        for speed in [0.0, -1.0, np.nan, 1e9]:
            with pytest.raises(ValueError, match="expected 0.001 to 100"):
                world.run(speed)


def resident_kib() -> int:
    """Memory of this process, KiB."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0])


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the size of a process is read from /proc")
def test_a_hundred_thousand_states_leave_nothing_behind() -> None:
    world = scenes.tube().start()

    def read(count: int) -> None:
        for _ in range(count):
            state = world.state("gut")
            assert state.positions.shape == state.velocities.shape

    def grown(of: Callable[[], int]) -> int:
        before = of()
        read(100_000)
        return of() - before

    read(1000)
    # a state's arrays are a kilobyte
    assert grown(resident_kib) < 10_000
    tracemalloc.start()
    read(100)
    before = tracemalloc.get_traced_memory()[0]
    read(5000)
    growth = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert growth < 10_000


def test_equal_worlds_have_equal_hashes_however_their_time_passes() -> None:
    hashes = []
    for advances in [1, 10]:
        world = scenes.bouncing().start()
        for _ in range(advances):
            world.advance(1.0 / advances)
        hashes.append(world.hash())
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("executor", ["lockstep", "threads", "pool"])
def test_at_the_free_pace_an_object_makes_every_step_however_slow_it_is(executor: Literal["lockstep", "threads", "pool"]) -> None:
    with mc.World.from_toml(scenes.SLOW, executor, "free") as world:
        for _ in range(2):
            world.advance(0.1)
        assert (world.pace, world.time, world.dropped) == ("free", 0.2, 0.0)
        assert [world.state(name).steps for name in ("slow", "quick")] == [200, 20]


def test_what_a_declared_machine_is_too_slow_for_is_said() -> None:
    assert mc.World.from_toml(scenes.SLOW).pace == "free"
    assert mc.World.from_toml(scenes.SLOW, "threads").pace == "real-time"
    world = mc.World.from_toml(scenes.SLOW, pace="real-time")
    world.advance(0.5)
    # a step of 1 ms takes 3 ms
    assert world.pace == "real-time"
    assert 0.2 < world.dropped < 0.5


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt: a shell that starts tests in the background has it ignored, and Python leaves that so."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_the_user_interrupts_what_takes_long() -> None:
    world = scenes.bouncing().start()
    long = np.zeros((2, 1_000_000, 3))
    calls: list[Callable[[], object]] = [
        lambda: world.advance(1e9),
        lambda: mc.rollout(scenes.bouncing(), "ball", long, step=1.0),
    ]
    for call in calls:
        timer = threading.Timer(0.05, signal.raise_signal, [signal.SIGINT])
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            call()
        timer.join()
    # in real time too: it stands where it had come to
    with scenes.bouncing().start("threads") as live:
        timer = threading.Timer(0.05, signal.raise_signal, [signal.SIGINT])
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            live.advance(600.0)
        timer.join()
        assert 0.0 < live.time < 300.0
        stood = live.time
        live.advance(0.01)
        assert live.time == pytest.approx(stood + 0.01)


def test_a_forked_child_has_none_of_the_threads_of_a_world_and_says_so() -> None:
    world = scenes.bouncing().start("threads")
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        # who waits is ended
        signal.alarm(20)
        said = "advanced"
        try:
            world.advance(0.01)
        except RuntimeError as error:
            said = str(error)
        world.stop()
        del world
        gc.collect()
        os.write(write_end, said.encode())
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    assert b"let the child make its own" in os.read(read_end, 1000)
    world.advance(0.01)
    world.stop()


def test_a_world_goes_back_to_a_checkpoint_also_from_a_file(tmp_path: Path) -> None:
    scene = mc.Scene().fixed("floor", mc.Plane()).add("ball", mc.Ball(0.05, mass=0.2, at=[0, 0, 0.5]))
    world = scene.start()
    world.advance(0.3)
    mark = world.checkpoint()
    mark.write(tmp_path / "mark")
    world.advance(0.4)
    after = world.hash()
    world.restore(mark)
    assert world.time == mark.time
    world.advance(0.4)
    assert world.hash() == after
    again = scene.start()
    again.restore(mc.Checkpoint.read(tmp_path / "mark"))
    again.advance(0.4)
    assert again.hash() == after
    # objects that were there are there again, in another world too
    world.add("box", mc.Box([0.1, 0.1, 0.1], at=[0, 0, 1.0]))
    world.advance(0.1)
    mark, seen = world.checkpoint(), world.state("ball").time
    mark.write(tmp_path / "mark")
    world.remove("ball")
    world.remove("box")
    world.advance(0.1)
    world.add("box", mc.Ball(0.02, at=[0, 0, 1.0]))
    world.restore(mark)
    again = scene.start()
    again.restore(mc.Checkpoint.read(tmp_path / "mark"))
    assert again.hash() == world.hash() and world.state("ball").time == seen
    with pytest.raises(ValueError, match="no checkpoint"):
        (tmp_path / "other").write_text("not one")
        mc.Checkpoint.read(tmp_path / "other")
    with pytest.raises(OSError):
        mc.Checkpoint.read(tmp_path / "missing")


def test_sensors_of_a_scene_in_code_sit_where_they_are_put() -> None:
    scene = mc.Scene(gravity=[0, 0, 0]).add("arm", mc.Box([0.2, 0.1, 0.05], mass=2.0))
    half = np.sqrt(0.5)
    # its x is the arm's y
    scene.sensor("tip", mc.Imu("arm", at=[0.2, 0.0, 0.0], rotation=[0.0, 0.0, half, half]))
    scene.sensor("felt", mc.ContactForce("arm")).sensor("corner", mc.Pose("arm", at=[0.2, 0.1, 0.05]))
    world = scene.start()
    world.velocity("arm", [0, 0, 0], [0, 0, 3.0])
    world.advance(0.25)
    assert world.sensor("tip") == pytest.approx([0.0, 9.0 * 0.2, 0.0, 0.0, 0.0, 3.0], abs=1e-9)
    assert world.sensor("felt") == pytest.approx([0.0, 0.0, 0.0])
    assert np.linalg.norm(world.sensor("corner")[:3]) == pytest.approx(np.hypot(np.hypot(0.2, 0.1), 0.05))
    with pytest.raises(TypeError, match="a sensor is an Imu.*not a Ball"):
        scene.sensor("wrong", mc.Ball(0.1))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match='"leg"'):
        mc.Scene().sensor("s", mc.Imu("leg")).start()


def test_a_scene_says_how_far_solves_of_contact_go() -> None:
    def landed(scene: mc.Scene) -> tuple[str, int, float, float]:
        world = scene.fixed("floor", mc.Plane()).add("box", mc.Box([0.05, 0.05, 0.05], at=[0.0, 0.0, 0.06])).start(pace="real-time")
        world.advance(0.2)
        solve = world.state("box").contact_solve
        assert solve is not None
        return solve

    level, _, miss, depth = landed(mc.Scene(contact="exact"))
    assert level != "interior" and miss < 1e-5 and 0.0 <= depth < 1e-4
    assert landed(mc.Scene(contact="budget", contact_least_steps=1))[3] < 1e-3
    with pytest.raises(ValueError, match="1 to 400"):
        landed(mc.Scene(contact="budget", contact_least_steps=0))
    with pytest.raises(ValueError, match="\"rough\""):
        mc.Scene(contact="rough")  # type: ignore[arg-type]
