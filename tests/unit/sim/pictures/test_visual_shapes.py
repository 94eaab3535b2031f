"""Visible shapes of bodies are those of their declarations."""

from __future__ import annotations

from aeros.sim.pictures.visual_shapes import shapes_of
from aeros.spec.model.scene import BASIN_WALL, Basin, Box, Compound, Cylinder, Part, Sphere

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def test_each_shape_has_its_size_and_colour() -> None:
    parts = Compound(
        (Part(Cylinder(0.1, 0.2), (0.0, 0.0, 1.0), BLUE), Part(Sphere(0.3), (1.0, 0.0, 0.0), RED))
    )
    (box,), (one, other) = shapes_of(Box((1.0, 2.0, 3.0)), RED), shapes_of(parts, RED)
    assert (box.kind, box.size, box.colour, box.opacity) == ("box", (1.0, 2.0, 3.0), RED, 1.0)
    assert (one.kind, one.size, one.colour, one.place.position) == (
        "cylinder",
        (0.1, 0.2, 0.0),
        BLUE,
        (0.0, 0.0, 1.0),
    )
    assert (other.kind, other.size) == ("sphere", (0.3, 0.0, 0.0))
    walls = list(shapes_of(Basin((0.2, 0.1, 0.05)), BLUE))
    assert len(walls) == 5
    assert {min(wall.size) for wall in walls} == {BASIN_WALL}
