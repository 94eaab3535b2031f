"""Calls that ask for an action are found from file to file, and only those that a skill may reach."""

from __future__ import annotations

import ast

import pytest

from aeros.spec.obligations.skill_syntax.action_calls import action_calls, written_parameters
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile

FILES = {
    "skills.py": "from .legs import leg as first\nact('loaded')\n"
    "def tidy(o, i):\n    yield from first(o)\n    yield act('own')\n"
    "def other(o, i):\n    yield act('other')\n",
    "legs.py": "from .deep import reach\nSTART = Action('constant', {})\n"
    "def leg(o):\n    yield from reach(o)\ndef unused(o, x=act('default')):\n    yield act('unused')\n",
    "deep.py": "def reach(o):\n    yield act('deep')\n",
    "lone.py": "act('lone')\n",
}


def _asked(function: str) -> set[tuple[str, str]]:
    files = {path: SkillFile(path, text.encode()) for path, text in FILES.items()}
    found = action_calls("skills.py", function, files)
    return {(file.source.path, ast.unparse(call.args[0]).strip("'")) for file, call in found}


def test_calls_are_followed_through_imports() -> None:
    loaded = {("skills.py", "loaded"), ("legs.py", "constant"), ("legs.py", "default")}
    assert _asked("tidy") == loaded | {("skills.py", "own"), ("deep.py", "deep")}
    assert _asked("other") == loaded | {("skills.py", "other")}
    assert _asked("absent") == loaded


@pytest.mark.parametrize(
    ("call", "names"),
    [
        ("act('grip', width=1, force=2)", ("width", "force")),
        ("act('grip', **more)", None),
        ("act('grip', 1)", None),
        ("Action('grip', {'width': 1})", ("width",)),
        ("Action('grip', {name: 1})", None),
        ("Action('grip', more)", None),
        ("Action('grip', {**more, 'width': 1})", None),
        ("Action('grip', {1: 1})", None),
        ("Action('grip', {'width': 1}, 3)", None),
        ("Action('grip', {'width': 1}, force=2)", None),
        ("Action('grip', {'width': 1}, **more)", None),
        ("Action('grip')", None),
        ("act('grip')", ()),
        ("act('grip', width=1, **more)", None),
        ("act(kind='grip')", None),
    ],
)
def test_parameters_are_those_that_are_written_out(call: str, names: tuple[str, ...] | None) -> None:
    node = ast.parse(call, mode="eval").body
    assert isinstance(node, ast.Call)
    assert written_parameters(node) == names
