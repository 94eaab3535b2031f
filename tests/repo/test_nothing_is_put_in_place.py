"""Motors move the robot and contact moves things: code that sets the place of a body directly is listed."""

from __future__ import annotations

import ast

from tests.repo.tree import ROOT

PLACING = (
    "resetJointState",
    "resetJointStateMultiDof",
    "resetJointStatesMultiDof",
    "resetBasePositionAndOrientation",
    "resetBaseVelocity",
    "resetSimulation",
    "restoreState",
)
"""Calls of PyBullet that place a body or give it a speed, without a motor or a contact."""

ALLOWED = {
    ("sim/bullet/panda.py", "_assemble"),  # before the clock starts
    ("sim/engine/people.py", "update"),  # people walk by themselves, and the robot does not move them
    ("sim/bullet/mirror.py", "place"),  # the window's own world, of which nothing is measured
}


def test_bodies_are_placed_before_the_clock_starts_alone() -> None:
    found = set()
    for path in sorted((ROOT / "aeros").rglob("*.py")):
        name = str(path.relative_to(ROOT / "aeros"))
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for function in ast.walk(tree):
            if isinstance(function, ast.FunctionDef):
                named = {one.attr for one in ast.walk(function) if isinstance(one, ast.Attribute)}
                named |= {str(one.value) for one in ast.walk(function) if isinstance(one, ast.Constant)}
                if named.intersection(PLACING):
                    found.add((name, function.name))
    assert found == ALLOWED
