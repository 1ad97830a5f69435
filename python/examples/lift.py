"""A Gymnasium environment: lift the middle of a soft tube to a height, by a force on it.

    pip install metachron gymnasium
    python lift.py

Observed: position and velocity of the tube's middle, and the wanted height. Rewarded: how near it is.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import metachron as mc
import numpy as np
from numpy.typing import NDArray

Observation = NDArray[np.float32]

LENGTH_M = 0.6
"""Of the tube, clamped at both ends."""
HEIGHTS_M = (0.45, 0.55)
"""Where the middle may be wanted; the ends are at 0.5 m."""
FORCE_MAX_N = 5.0
STEP_S = 0.02
"""Of simulated time that an action acts for."""


def scene() -> mc.Scene:
    """The tube over a floor."""
    ends = [[-LENGTH_M / 2, 0.0, 0.5], [LENGTH_M / 2, 0.0, 0.5]]
    gut = mc.Tube(ends, radius=0.015, wall=0.002, segments=20, clamp=["start", "end"], damping=2.0)
    return mc.Scene().fixed("floor", mc.Plane()).add("gut", gut)


class Lift(gym.Env[Observation, Observation]):
    """An action is a force in parts of the greatest one, along x, y and z."""

    metadata = {"render_modes": []}

    def __init__(self) -> None:
        self.action_space = gym.spaces.Box(-1.0, 1.0, (3,), np.float32)
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (7,), np.float32)
        self._wanted = HEIGHTS_M[0]
        self._world = scene().start()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        super().reset(seed=seed)
        self._wanted = float(self.np_random.uniform(*HEIGHTS_M))
        self._world = scene().start()
        return self._observed(), {}

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        self._world.force("gut", action * FORCE_MAX_N, arc=LENGTH_M / 2)
        self._world.advance(STEP_S)
        observed = self._observed()
        reward = -abs(float(observed[2]) - self._wanted)
        return observed, reward, False, self._world.time >= 2.0, {}

    def _observed(self) -> Observation:
        position, velocity = self._world.state("gut").point(arc=LENGTH_M / 2)
        return np.concatenate([position, velocity, [self._wanted]]).astype(np.float32)


def main() -> None:
    """Holds the tube by a force in proportion to what it lacks."""
    env = Lift()
    observed, _ = env.reset(seed=1)
    ended = False
    while not ended:
        lacks = float(observed[6] - observed[2])
        upwards = np.clip(40.0 * lacks - 2.0 * float(observed[5]), -1.0, 1.0)
        observed, reward, _, ended, _ = env.step(np.array([0.0, 0.0, upwards], np.float32))
    print(f"wanted {observed[6]:.3f} m, is {observed[2]:.3f} m: reward {reward:.4f}")


if __name__ == "__main__":
    main()
