"""Pictures show colour and distance, and a painted rectangle as it was painted last."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Camera

_ABOVE = Camera(eye=(0.0, 0.0, 1.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), field_of_view=40.0)


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    made = PhysicsWorld()
    yield made
    made.close()


def test_depth_is_the_distance_along_the_optical_axis(world: PhysicsWorld) -> None:
    world.bodies.add_box((2.0, 2.0, 0.2), (0.0, 0.0, 0.0))
    seen = world.renderer.render(_ABOVE)
    assert seen.rgb.shape == (_ABOVE.height, _ABOVE.width, 3)
    assert seen.depth.shape == (_ABOVE.height, _ABOVE.width)
    assert np.allclose(seen.depth, 0.9, atol=0.005)


def test_a_rectangle_shows_the_picture_that_was_painted_last(world: PhysicsWorld) -> None:
    rectangle = world.bodies.add_textured_rectangle((-0.5, -0.5), (0.5, 0.5), 0.0)
    for colour in ((200, 20, 20), (20, 20, 200)):
        world.renderer.paint(rectangle, np.full((4, 4, 3), colour, dtype=np.uint8))
    red, _, blue = world.renderer.render(_ABOVE).rgb[_ABOVE.height // 2, _ABOVE.width // 2]
    assert blue > 2 * red
