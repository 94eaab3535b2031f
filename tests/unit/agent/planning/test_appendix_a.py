"""The planning rules of the shipped modules against the listings of the paper's Appendix A, as printed."""

from __future__ import annotations

import re
from itertools import product
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.world.world import WorldModel
from tests.differential.reference_cases import reference

DUMPLINGS = """
def plan(world_state):
    steps = []
    if not world.dough_on_workspace
       or not world.filling_on_workspace:
        steps += [dumpling.prepare]
    if not world.wrapper_aligned
       and not world.dumpling_wrapped:
        steps += [dumpling.recover]
    if not world.dumpling_wrapped:
        steps += [dumpling.wrap,
                  retry=2,
                  on_failure=dumpling.recover]
    if not world.dumpling_cooked:
        steps += [dumpling.boil]
    return steps
"""
# "Retry and recovery for clean.wipe are injected at the agent level (retry=1, on_failure=clean.recover)."
TABLE = """
def plan(world_state):
    steps = []
    if not world.table_wiped:
        steps += [clean.wipe, retry=1, on_failure=clean.recover]
    if not world.table_organized:
        steps += [clean.organize]
    return steps
"""
FETCH = """
def plan(world_state):
    steps = []
    if not world.robot_at_target:
        steps += [fetch.navigate]
    if not world.object_detected:
        steps += [fetch.detect]
    if not world.object_grasped:
        steps += [fetch.grasp,
                  retry=1,
                  on_failure=fetch.recover]
    if not world.object_delivered:
        steps += [fetch.deliver]
    return steps
"""
ADDED = {
    "wiping_area_clear": True,
    "table_verified": True,
    "robot_at_table": True,
    "robot_at_bench": True,
    "overhead_off": False,
    "clutter_ungraspable": False,
    "wrappers_suffice": True,
    "fillings_suffice": True,
}
"""Where these hold, the rules that the shipped modules add to the paper's ask for nothing."""


def printed_plan(listing: str, values: dict[str, bool]) -> list[tuple[str, int, str | None]]:
    """The steps that the printed code emits: skill, retries, and the skill after the last."""
    code = re.sub(r"\n +(or|and) not", r" \1 not", listing)
    code = re.sub(r"steps \+= \[(\w+\.\w+)", r"steps += [step('\1'", code)
    code = re.sub(r"on_failure=(\w+\.\w+)", r"on_failure='\1'", code).replace("]\n", ")]\n")
    code = code.replace("steps = [)]", "steps = []")

    def step(skill: str, retry: int = 0, on_failure: str | None = None) -> tuple[str, int, str | None]:
        last = None if on_failure is None else on_failure.split(".")[1]
        return skill.split(".")[1], retry, last

    names: dict[str, Any] = {"step": step, "world": SimpleNamespace(**values)}
    exec(code, names)  # noqa: S102  the paper's listing, above
    found: list[tuple[str, int, str | None]] = names["plan"](None)
    return found


@pytest.mark.parametrize(
    ("module", "listing", "names"),
    [
        (
            "make_dumplings",
            DUMPLINGS,
            (
                *("dough_on_workspace", "filling_on_workspace", "wrapper_aligned"),
                *("dumpling_wrapped", "dumpling_cooked"),
            ),
        ),
        ("clean_table", TABLE, ("table_wiped", "table_organized")),
        (
            "fetch_object",
            FETCH,
            ("robot_at_target", "object_detected", "object_grasped", "object_delivered"),
        ),
    ],
)
def test_the_shipped_rules_emit_what_the_paper_prints(
    module: str, listing: str, names: tuple[str, ...]
) -> None:
    case = reference(module, 0)
    for values in product((False, True), repeat=len(names)):
        known: dict[str, Any] = ADDED | dict(zip(names, values, strict=True))
        # The shipped rule counts: one dumpling is asked for, and cooked or not.
        counts = {"count": 1, "dumplings_cooked": int(known.get("dumpling_cooked", False))}
        measured = {f"{module}.{name}": value for name, value in {**known, **counts}.items()}
        world = WorldModel(0.0, measured, {}, measured)
        graph = RulePlanner().plan(RoutedTask(module, case.task), world, {module: case.ecm})
        assert all(one.between_tries is None for one in graph.steps)
        found = [
            (one.skill, one.retry, None if one.on_failure is None else one.on_failure.skill)
            for one in graph.steps
        ]
        assert found == printed_plan(listing, known)
