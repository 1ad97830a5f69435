"""Examples run, and the Gymnasium environment is one."""

import runpy
import warnings
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

PYTHON = Path(__file__).parent.parent
EXAMPLES = PYTHON / "examples"


def test_the_environment_passes_gymnasiums_own_checks() -> None:
    env = runpy.run_path(str(EXAMPLES / "lift.py"))["Lift"]()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # positions have no bounds, and so neither has the space
        warnings.filterwarnings("ignore", message=".*Box observation space.*")
        check_env(env, skip_render_check=True)
    observed, _ = env.reset(seed=3)
    again, _ = env.reset(seed=3)
    assert np.array_equal(observed, again)


def test_the_example_comes_near_the_wanted_height(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLES / "lift.py"), run_name="__main__")
    assert float(capsys.readouterr().out.split("reward")[1]) > -0.02


def test_the_program_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    program = (PYTHON / "README.md").read_text().split("```python\n")[1].split("```")[0]
    exec(program, {})
    printed = capsys.readouterr().out.splitlines()
    # the ball falls half a metre, less its radius, in 0.3 s
    assert float(printed[0].split()[0]) == pytest.approx(0.5, abs=1.0 / 240.0)
    assert '"ball" begins to touch "floor"' in printed[1]
