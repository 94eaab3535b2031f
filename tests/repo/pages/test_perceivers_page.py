"""docs/perceivers.md is right: its perceiver finds a cube, and its table has the whole toolkit."""

from __future__ import annotations

import ast
import inspect
import re

import numpy as np
import pytest

import aeros.perception
from aeros.perception.view_builder import PictureData, build_view
from aeros.runtime.perception.perceiver_run import NAMES
from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.perceiver_code import execute_perceiver
from aeros.spec.obligations.skill_syntax.allowed_syntax import first_refusal
from aeros.spec.obligations.skill_syntax.perceiver_names import PERCEIVER_NAMES
from tests.repo.tree import text_of

_PAGE = text_of("docs/perceivers.md")


def test_its_perceiver_is_allowed_and_finds_a_cube() -> None:
    (program,) = re.findall(r"```python\n(.*?)```", _PAGE, re.DOTALL)
    assert first_refusal(ast.parse(program), PERCEIVER_NAMES) is None
    see = execute_perceiver(
        CodeFile("m", "perceivers.py", "perceivers.py", program.encode()), "see_cube", NAMES
    )
    rgb, depth = np.full((120, 160, 3), 200, np.uint8), np.ones((120, 160), np.float32)
    empty = rgb.tobytes()
    # A square of blue 4 cm over the table, in the middle of the picture, straight below the camera.
    rgb[50:70, 70:90], depth[50:70, 70:90] = (20, 30, 220), 0.96
    place = ((0.5, 0.1, 1.0), (0.5, 0.1, 0.0), (1.0, 0.0, 0.0), 40.0, (160, 120))
    views = [
        build_view(1.0, {}, {}, [PictureData("overhead", 1.0, (160, 120), colours, depth.tobytes(), *place)])
        for colours in (rgb.tobytes(), empty)
    ]
    running = see(views[0])
    found = next(running)
    assert found["cube_seen"] is True
    assert found["cube_position"].value == pytest.approx((0.5, 0.1, 0.02), abs=0.005)
    assert running.send(views[1]) == {"cube_seen": False}


def test_its_table_has_every_function_of_the_toolkit() -> None:
    members = {name: getattr(aeros.perception, name) for name in aeros.perception.__all__}
    functions = {name for name, member in members.items() if inspect.isfunction(member)} - {"estimate"}
    rows = re.findall(r"^\| (`.*?`) \| [a-z]", _PAGE.partition("## Toolkit")[2], re.MULTILINE)
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == functions
