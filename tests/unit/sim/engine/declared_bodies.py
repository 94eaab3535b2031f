"""Declared bodies that tests add to a world, with places in a file."""

from __future__ import annotations

from typing import Any

from aeros.sim.geometry import Vector3
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.scene import GREY, Box, Placement, SceneBody

SOURCE = Source("scene.yaml", "crate bottle\npole")
CUBE = Box((0.1, 0.1, 0.1))


def body(
    name: str = "crate", shape: Any = CUBE, position: Vector3 = (0.0, 0.0, 0.05), **more: Any
) -> SceneBody:
    start = SOURCE.text.find(name)
    yaw = more.pop("yaw", 0.0)
    placement = Placement(None, position, yaw, (0.0, 0.0, 0.0), 0.0, name)
    values = {
        "mass": 0.0,
        "friction": 0.5,
        "spinning": 0.02,
        "rolling_resistance": 0.0,
        "colour": GREY,
        "grip": None,
        **more,
    }
    return SceneBody(name, shape, placement, span=SOURCE.span(start, start + len(name)), **values)
