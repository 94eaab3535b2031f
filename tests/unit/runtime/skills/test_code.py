"""Execution of a module's code: its own names, its own files, and nothing of another run."""

from __future__ import annotations

import sys
from typing import Any

import pytest

from aeros.runtime.skills.code import CodeFile
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.skill import act

CODE = b"""
from aeros.skill import act
runs = []
def lift(observed, inputs):
    runs.append(1)
    yield act("move", count=len(runs))
def no_skill(observed, inputs):
    return None
"""


def executed(code: bytes = CODE, function: str = "lift", name: str = "parts/skills.py") -> Any:
    return CodeFile("handling", name, "/ecms/handling/parts/skills.py", code).generator_function(function)


def test_a_file_is_executed_afresh_under_a_private_name() -> None:
    for _ in range(2):
        function = executed()
        assert next(function({}, {})) == act("move", count=1)
    assert function.__module__ == "_aeros_ecm_handling.parts.skills"
    assert sys.modules[function.__module__].__file__ == "/ecms/handling/parts/skills.py"
    assert function.__code__.co_filename == "/ecms/handling/parts/skills.py"


@pytest.mark.parametrize("function", ["absent", "no_skill", "runs", "act"])
def test_only_a_generator_function_is_a_skill(function: str) -> None:
    why = f"`parts/skills.py` of module `handling` has no generator function `{function}`"
    with pytest.raises(SkillRefusedError, match=why):
        executed(function=function)


@pytest.mark.parametrize(
    ("code", "why"),
    [
        (b"raise ValueError('no')", "fails to load: ValueError: no"),
        (b"raise SystemExit(3)", "fails to load: SystemExit: 3"),
        (b"def lift(:", "fails to load: SyntaxError"),
        (b"\xff", "fails to load: SyntaxError"),
    ],
)
def test_code_that_raises_is_refused_and_leaves_no_module(code: bytes, why: str) -> None:
    with pytest.raises(SkillRefusedError, match=why):
        executed(code, name="broken.py")
    assert "_aeros_ecm_handling.broken" not in sys.modules


def test_a_keyboard_interrupt_is_nobodys_error() -> None:
    with pytest.raises(KeyboardInterrupt):
        executed(b"raise KeyboardInterrupt")


def test_code_inherits_no_future_of_ours() -> None:
    (annotation,) = (executed(b"def lift(o: 1 + 1, i): yield").__annotations__["o"],)
    assert annotation == 2


# Files that import each other.

SKILLS = b"""
from aeros.skill import act
from .legs import Leg, leg
def lift(observed, inputs):
    yield act("move", count=leg(Leg(2)))
"""
LEGS = b"""
from typing import NamedTuple
from .numbers import FACTOR
runs = []
class Leg(NamedTuple):
    steps: int
def leg(one):
    runs.append(one)
    return FACTOR * one.steps + len(runs)
"""
NUMBERS = b"FACTOR = 10\n"


def with_neighbours(code: bytes = SKILLS, **neighbours: bytes) -> Any:
    files = tuple((f"{name}.py", content) for name, content in neighbours.items())
    return CodeFile("handling", "skills.py", "/ecms/handling/skills.py", code, files).generator_function(
        "lift"
    )


def test_a_file_imports_its_neighbours_from_their_bytes_and_afresh() -> None:
    for _ in range(2):
        assert next(with_neighbours(legs=LEGS, numbers=NUMBERS)({}, {})) == act("move", count=21)
    assert "legs" not in sys.modules
    assert sys.modules["_aeros_ecm_handling.legs"].__file__ == "/ecms/handling/legs.py"


@pytest.mark.parametrize(
    ("legs", "why"),
    [
        (b"from .absent import FACTOR", r"`handling` has no file for `\.absent`"),
        (b"from . import numbers", r"has no file for `\.`"),
        (b"from ..handling import numbers", r"has no file for `\.\.handling`"),
        (b"from .numbers import ABSENT", "cannot import name 'ABSENT'"),
        (b"from .skills import lift", "`skills.py` imports itself"),
        (b"from .legs import leg", "`legs.py` imports itself"),
        (b"from numbers import FACTOR", "cannot import name 'FACTOR' from 'numbers'"),
        (b"raise ValueError('no')", "fails to load: ValueError: no$"),
    ],
)
def test_only_certified_neighbours_are_imported(legs: bytes, why: str) -> None:
    with pytest.raises(SkillRefusedError, match=why):
        with_neighbours(legs=legs, numbers=NUMBERS)
    assert "_aeros_ecm_handling.legs" not in sys.modules
    assert "_aeros_ecm_handling.skills" not in sys.modules
