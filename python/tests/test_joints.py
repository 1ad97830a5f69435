"""Coordinates of joints, lists of what a world has, and all states at once."""

import metachron as mc
import numpy as np
import pytest
import scenes

LENGTH = 0.4


def arm() -> mc.Scene:
    """Two bars along x without gravity, hinged about y in the origin and to each other, and a cart on a slide."""
    bar = [LENGTH / 2, 0.01, 0.01]
    scene = mc.Scene(gravity=[0.0, 0.0, 0.0])
    scene.add("upper", mc.Box(bar, at=[LENGTH / 2, 0.0, 0.0], rate=1000))
    scene.add("lower", mc.Box(bar, at=[1.5 * LENGTH, 0.0, 0.0], rate=1000))
    scene.add("cart", mc.Box([0.1, 0.1, 0.1], at=[0.0, 2.0, 0.0], rotation=[0.0, 0.0, 3.0, 3.0], rate=1000))
    scene.joint("shoulder", mc.Revolute([0.0, 1.0, 0.0], at=[0.0, 0.0, 0.0]), "upper")
    scene.joint("elbow", mc.Revolute([0.0, 1.0, 0.0], at=[LENGTH, 0.0, 0.0], range=(-1.0, 2.0)), "upper", "lower")
    # its axis is the world's, though the cart is turned
    return scene.joint("rail", mc.Prismatic([1.0, 0.0, 0.0], at=[0.0, 2.0, 0.0], range=(-0.5, 0.5)), "cart")


def test_a_joint_that_leaves_no_motion_is_named_as_in_scene_files() -> None:
    scene = mc.Scene().add("ball", mc.Ball(0.1)).joint("hold", mc.Fixed(at=[0.0, 0.0, 0.0]), "ball")
    assert scene.start().joints["hold"].kind == "fixed"


def test_a_world_lists_its_objects_joints_and_sensors() -> None:
    scene = arm().sensor("angle", mc.JointPosition("elbow")).sensor("imu", mc.Imu("lower"))
    world = scene.start()
    assert [thing.name for thing in world.objects] == ["upper", "lower", "cart"]
    assert world.sensors == ["angle", "imu"]
    joints = list(world.joints)
    assert [(joint.number, joint.name, joint.kind) for joint in joints] == [
        (0, "shoulder", "revolute"),
        (1, "elbow", "revolute"),
        (2, "rail", "prismatic"),
    ]
    elbow = world.joints["elbow"]
    assert (elbow.a, elbow.b, elbow.range) == ("upper", "lower", (-1.0, 2.0))
    assert (joints[0].b, joints[0].range) == (None, None)
    assert len(world.joints) == 3
    assert (repr(world.joints), repr(elbow)) == (
        "<Joints [shoulder, elbow, rail]>",
        "<Joint \"elbow\", revolute of \"upper\" and \"lower\">",
    )
    with pytest.raises(KeyError, match="its joints with names are .shoulder, elbow, rail"):
        _ = world.joints["knee"]
    with pytest.raises(KeyError, match="no joint 3; it has 3"):
        _ = world.joints[3]


def test_coordinates_put_bodies_where_trigonometry_says() -> None:
    world = arm().start()
    # a coordinate is how far b, here the world, has turned against a
    world.joints.set([-0.5, 0.8, 0.0])
    world.joints.set(velocities={"rail": -0.25})
    world.joints.set({"rail": -0.2})
    assert world.joints.positions == pytest.approx([-0.5, 0.8, -0.2])
    assert world.joints.velocities == pytest.approx([0.0, 0.0, -0.25])
    world.advance(0.001)
    ends = LENGTH * np.array([[0.5 * np.cos(0.5), 0.0, -0.5 * np.sin(0.5)], [np.cos(0.5), 0.0, -np.sin(0.5)]])
    assert world.state("upper").positions[0] == pytest.approx(ends[0], abs=1e-9)
    lower = ends[1] + LENGTH / 2 * np.array([np.cos(1.3), 0.0, -np.sin(1.3)])
    assert world.state("lower").positions[0] == pytest.approx(lower, abs=1e-9)
    # the world slides back against the cart, so that the cart goes on
    assert world.state("cart").positions[0] == pytest.approx([0.2 + 0.25e-3, 2.0, 0.0], abs=1e-9)
    world.joints.reset()
    assert world.joints.positions == pytest.approx([0.0, 0.0, 0.0])
    assert (world.joints.velocities == 0.0).all()


def test_a_joint_follows_another_by_its_ratio() -> None:
    scene = mc.Scene(gravity=[0.0, 0.0, 0.0])
    scene.add("wheel", mc.Box([0.1, 0.1, 0.1], rate=1000)).add("cart", mc.Box([0.1, 0.1, 0.1], at=[0.0, 2.0, 0.0], rate=1000))
    scene.joint("rail", mc.Prismatic([1.0, 0.0, 0.0], at=[0.0, 2.0, 0.0]), "cart")
    axle = mc.Revolute([0.0, 1.0, 0.0], at=[0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match='follows the joint "knee", and the scene has none of that name'):
        arm().joint("axle", axle, "lower", mimic="knee").start()
    world = scene.joint("axle", axle, "wheel", mimic="rail", ratio=2.0).start()
    world.joints.set(velocities={"rail": 0.3})
    assert world.joints.velocities == pytest.approx([0.3, 0.6])
    world.advance(0.5)
    assert world.joints.positions == pytest.approx([0.15, 0.3], abs=1e-6)


def test_coordinates_that_cannot_be_are_refused() -> None:
    world = arm().start()
    with pytest.raises(ValueError, match='the position of joint "elbow" is 2.5; expected -1 to 2 rad'):
        world.joints.set({"shoulder": 0.1, "elbow": 2.5})
    with pytest.raises(ValueError, match="positions has 2 numbers; the world has 3 hinges and slides"):
        world.joints.set([0.0, 0.0])
    with pytest.raises(KeyError, match="no joint .knee"):
        world.joints.set({"knee": 0.0})
    with pytest.raises(TypeError, match="positions: expected numbers by names of joints"):
        world.joints.set({"elbow": "far"})  # type: ignore[dict-item]
    assert (world.joints.positions == 0.0).all()


def test_all_states_at_once_are_those_of_the_objects() -> None:
    world = scenes.tube().add("ball", mc.Ball(0.05, at=[0.0, 1.0, 0.5], rotation=[0.0, 0.0, 0.0, -2.0])).start()
    world.advance(0.1)
    states = world.states()
    assert states.names == ["gut", "ball"]
    assert states.starts.tolist() == [0, 21, 22]
    for at, name in enumerate(states.names):
        state, part = world.state(name), slice(states.starts[at], states.starts[at + 1])
        assert states.times[at] == state.time
        assert (states.positions[part] == state.positions).all()
        assert (states.velocities[part] == state.velocities).all()
    assert np.isnan(states.rotations[0]).all() and np.isnan(states.spins[0]).all()
    assert (states.rotations[1] == world.state("ball").rotation).all()
    assert abs(states.rotations[1, 3]) == 1.0
    assert not states.positions.flags.writeable
    assert repr(states) == "<States of 2 objects>"
