"""A wait names its subject, and ends when it cannot help any more."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.execution.waiting import (
    MAX_WAIT_S,
    Wait,
    is_about_person,
    wait_after_denial,
    wait_for_condition,
)
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from aeros.spec.model.site import Site

PERSON = UnmetBound("human_distance", 0.41, "at least", 0.5, "m")
HEIGHT = UnmetBound("fill_level", 0.2, "at least", 0.5)
SILENT = UnmetBound("tool_position", None, "known", True, reason="is missing")
NEAR = "something in the scanners' plane at 0.41 m, which may be a person, goes away"
UNWRAPPED = UnmetBound("dumpling_wrapped", False, "is", True)


def test_a_scanner_sees_people_and_boxes_alike(cell: Site) -> None:
    cause = Cause("rule", "separation", "human_distance >= 0.5 m", shortfalls=(PERSON,), code="AE750")
    other = replace(cell, area_scanners=None)
    assert wait_after_denial([cause], other) == Wait("the person at 0.41 m goes away", MAX_WAIT_S)
    assert wait_after_denial([cause], cell) == Wait(NEAR, MAX_WAIT_S)
    assert is_about_person(cause, cell)


@pytest.mark.parametrize(("window_s", "limit_s"), [(600, 601.0), (10, MAX_WAIT_S)])
def test_a_used_up_quota_is_waited_for_until_its_window_frees_it(
    window_s: int, limit_s: float, cell: Site
) -> None:
    (quota,) = (one for one in cell.quotas if one.id == "grip-rate")
    site = replace(cell, quotas=(replace(quota, window_s=Fraction(window_s)),))
    causes = [Cause("gate", "grip-rate", "the quota is used up", code="AE742")]
    freed = f"the quota `grip-rate` is free again, which takes {window_s} s at most"
    assert wait_after_denial(causes, site) == Wait(freed, limit_s)
    person = Cause("rule", "separation", "", shortfalls=(PERSON,), code="AE750")
    both = wait_after_denial([*causes, person], site)
    assert both == Wait(f"{freed}; {NEAR}", limit_s)


@pytest.mark.parametrize(
    ("causes", "subject"),
    [
        ([Cause("hold", "m.carry", "", shortfalls=(PERSON,))], NEAR),
        (
            [Cause("precondition", "m.boil", "", shortfalls=(HEIGHT, SILENT))],
            "`tool_position` is measured",
        ),
        (
            [Cause("precondition", "m.boil", "", shortfalls=(UNWRAPPED, SILENT))],
            "`tool_position` is measured",
        ),
        ([Cause("hold", "m.carry", "", shortfalls=(HEIGHT, PERSON))], NEAR),
        ([Cause("precondition", "m.boil", "", shortfalls=(UNWRAPPED,))], None),
        ([Cause("precondition", "m.boil", "", shortfalls=(UNWRAPPED, PERSON))], None),
        ([Cause("precondition", "m.boil", "false", shortfalls=(UnmetBound("", None, "", True),))], None),
        ([Cause("input", "m.boil", "force is too large")], None),
        ([Cause("precondition", "m.boil", "", shortfalls=(HEIGHT,)), Cause("inactive", "n.x", "")], None),
        ([], None),
    ],
)
def test_a_condition_is_waited_for_if_no_action_has_to_change_it(
    causes: list[Cause], subject: str | None, cell: Site
) -> None:
    assert wait_for_condition(causes, cell) == (None if subject is None else Wait(subject))
