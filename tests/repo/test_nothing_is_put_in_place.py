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

STATE = ("mocap_pos", "mocap_quat", "qpos", "qvel")
"""Arrays of MuJoCo that hold places and speeds."""

ALLOWED = {
    ("sim/bullet/robot.py", "_assemble"),  # before the clock starts
    ("sim/bullet/engine.py", "move"),  # people walk by themselves, and the robot does not move them
    ("sim/mujoco/model.py", "_place_moved"),  # people likewise
    ("sim/mujoco/robot.py", "_place_joints"),  # before the clock starts
    ("sim/film/film_model.py", "_put"),  # a world of a film, of which nothing is measured
    ("sim/bullet/mirror.py", "place"),  # the window's own world, of which nothing is measured
}


def _writes_state(function: ast.FunctionDef) -> bool:
    """Check that it assigns to places or speeds of MuJoCo."""
    assigned = [
        target
        for one in ast.walk(function)
        if isinstance(one, ast.Assign | ast.AugAssign)
        for target in (one.targets if isinstance(one, ast.Assign) else [one.target])
    ]
    named = {one.attr for target in assigned for one in ast.walk(target) if isinstance(one, ast.Attribute)}
    return bool(named.intersection(STATE))


def test_bodies_are_placed_before_the_clock_starts_alone() -> None:
    found = set()
    for path in sorted((ROOT / "aeros").rglob("*.py")):
        name = str(path.relative_to(ROOT / "aeros"))
        text = path.read_text(encoding="utf-8")
        if not any(word in text for word in (*PLACING, *STATE)):
            continue
        tree = ast.parse(text)
        for function in ast.walk(tree):
            if isinstance(function, ast.FunctionDef):
                named = {one.attr for one in ast.walk(function) if isinstance(one, ast.Attribute)}
                named |= {str(one.value) for one in ast.walk(function) if isinstance(one, ast.Constant)}
                if named.intersection(PLACING) or _writes_state(function):
                    found.add((name, function.name))
    assert found == ALLOWED
