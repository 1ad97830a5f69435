"""Rollouts are the worlds that one would play one by one."""

import metachron as mc
import numpy as np
import pytest
import scenes


def test_a_rollout_is_the_same_on_any_number_of_threads() -> None:
    actions = np.random.default_rng(7).normal(size=(5, 12, 3))
    played = [mc.rollout(scenes.bouncing(), "ball", actions, step=0.02, threads=n) for n in (1, 2)]
    assert (played[0].hashes == played[1].hashes).all()
    assert (played[0].positions["ball"] == played[1].positions["ball"]).all()
    assert len(set(played[0].hashes.tolist())) == 5
    world = scenes.bouncing().start()
    for newtons in actions[3]:
        world.force("ball", newtons)
        world.advance(0.02)
    assert world.hash() == played[0].hashes[3]
    assert (world.state("ball").positions == played[0].positions["ball"][3, -1]).all()


def test_a_rollout_pushes_as_mechanics_says_and_observes_what_it_is_asked_for() -> None:
    actions = np.zeros((2, 10, 3))
    actions[1, :, 0] = 2.0
    played = mc.rollout(scenes.floating(), "ball", actions, step=0.05, observe=["ball"])
    # F t / m, whole steps of 1/240 s
    assert played.velocities["ball"][1, -1, 0, 0] == pytest.approx(2.0 * 0.5 / 0.5, abs=1e-6)
    assert (played.positions["ball"][0] == 0.0).all()
    tube = mc.rollout(scenes.tube(), "gut", actions.astype(np.float32), step=0.01, arc=0.3)
    assert tube.positions["gut"].shape == (2, 10, 21, 3)


def test_wrong_rollouts_say_what_is_wrong_and_in_which_world() -> None:
    actions = np.zeros((3, 4, 3))
    with pytest.raises(TypeError, match="step"):
        mc.rollout(scenes.floating(), "ball", actions)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match=r"\(worlds, steps, 3\)"):
        mc.rollout(scenes.floating(), "ball", np.zeros((3, 4, 2)), step=0.1)
    with pytest.raises(ValueError, match="threads is 0"):
        mc.rollout(scenes.floating(), "ball", actions, step=0.1, threads=0)
    # no more than there are worlds
    mc.rollout(scenes.floating(), "ball", actions, step=0.1, threads=10**18)
    with pytest.raises(ValueError, match="step is 0.0 s"):
        mc.rollout(scenes.floating(), "ball", actions, step=0.0)
    with pytest.raises(TypeError, match="argument 'observe': expected a list of names"):
        mc.rollout(scenes.floating(), "ball", actions, step=0.1, observe="ball")
    with pytest.raises(KeyError, match='no moving object "bell"'):
        mc.rollout(scenes.floating(), "bell", actions, step=0.1)
    actions[2, 1, 0] = np.nan
    with pytest.raises(ValueError, match="world 2: .*finite"):
        mc.rollout(scenes.floating(), "ball", actions, step=0.1)
