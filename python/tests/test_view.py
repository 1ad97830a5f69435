"""Pictures show what is there, where it is."""

import os
import subprocess
import sys

import metachron as mc
import numpy as np
import pytest

RED = """format = 1
[[object]]
name = "ball"
model = "rigid"
shape = "ball"
radius_m = 0.1
position_m = [0.0, 0.0, 1.0]
colour = "#e01010"
[[camera]]
name = "front"
eye_m = [0.0, -2.0, 1.0]
look_at_m = [0.0, 0.0, 1.0]
fov_deg = 30.0
"""

try:
    mc.World.from_toml(RED).render(size=(8, 8))
except RuntimeError as error:
    if "feature `view`" in str(error):
        pytest.skip(str(error), allow_module_level=True)
    raise


def test_a_red_ball_in_the_middle_of_a_picture_has_its_colour_and_its_size_there() -> None:
    world = mc.World.from_toml(RED)
    middle = world.state("ball").positions[0]
    size, fov = (320, 240), 0.6
    camera = mc.Camera([0.0, -2.0, middle[2]], middle, fov)
    image = world.render(size, camera)
    assert image.shape == (240, 320, 4) and image.dtype == np.uint8
    assert (image[..., 3] == 255).all()
    red = image[..., 0] > 2.0 * image[..., 1:3].max(axis=2)
    rows, columns = np.nonzero(red)
    # the cone that touches a ball of 0.1 m at 2 m
    radius = 120.0 / np.tan(0.5 * fov) * np.tan(np.arcsin(0.1 / 2.0))
    for found, half in [(rows, 120.0), (columns, 160.0)]:
        low, high = found.min(), found.max() + 1
        assert 0.5 * (low + high) == pytest.approx(half, abs=2.0)
        assert 0.5 * (high - low) == pytest.approx(radius, abs=2.0)
    depth = world.render_depth(size, camera)
    assert depth.shape == (240, 320) and depth.dtype == np.float32
    assert depth[120, 160] == pytest.approx(1.9, abs=0.01)
    # it falls out of the picture of the scene's own camera
    world.advance(0.5)
    seen = world.render(size, "front")
    assert not (seen[..., 0] > 2.0 * seen[..., 1:3].max(axis=2)).any()


def test_pictures_that_cannot_be_say_why() -> None:
    world = mc.World.from_toml(RED)
    with pytest.raises(ValueError, match=r"size is \(0, 720\)"):
        world.render((0, 720))
    with pytest.raises(KeyError, match="no camera .*front"):
        world.render(camera="back")
    with pytest.raises(ValueError, match="fov is 4.0 rad"):
        world.render(camera=mc.Camera([0, -1, 0], [0, 0, 0], 4.0))
    with pytest.raises(ValueError, match="two different"):
        world.render(camera=mc.Camera([0, 0, 0], [0, 0, 0]))
    with pytest.raises(TypeError, match="got a int"):
        world.render(camera=3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="too large"):
        world.render((1, 1_000_000))


def test_without_an_adapter_a_picture_says_what_is_missing() -> None:
    code = "import metachron as mc; mc.Scene().add('a', mc.Ball(0.1)).start().render((8, 8))"
    asked = {**os.environ, "WGPU_ADAPTER_NAME": "no such adapter"}
    ended = subprocess.run([sys.executable, "-c", code], env=asked, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1
    assert "RuntimeError: no graphics adapter was found" in ended.stderr
    assert "no such adapter" in ended.stderr
