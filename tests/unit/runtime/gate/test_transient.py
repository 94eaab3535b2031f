"""Transient denials: those whose reasons all depend on measured values."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.runtime.gate.decision import Reason
from aeros.runtime.gate.transient import is_transient_denial
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime.bench import Request, codes, configuration, gate, request, without


@pytest.mark.parametrize(
    ("asked", "passing"),
    [
        (request("quickly", "move", human_distance=0.4), True),
        (request("quickly", "carry", stop_pressed=True, human_distance=0.4), True),
        (without(request("quickly", "move"), "human_distance"), True),
        (request("quickly", "move", speed=0.6), False),
        (request("quickly", "carry", gait=0.2), False),
        (request("quickly", "move", human_distance=0.4, speed=0.6), False),
        (request("slowly", "sweep"), False),
        (request("quickly", "move", human_distance="near"), False),
    ],
)
def test_a_denial_is_transient_if_every_reason_is_about_the_state(asked: Request, passing: bool) -> None:
    decision = asked.decided_by(gate())
    assert decision.action is None, codes(decision)
    assert is_transient_denial(decision.reasons, asked.action.kind, configuration().site) is passing


@pytest.mark.parametrize(("about", "passing"), [("joint_position", True), ("target", False)])
def test_displaced_joints_are_transient_but_a_wrong_plan_is_not(about: str, passing: bool) -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert is_transient_denial([Reason("AE761", about, "elsewhere")], "move_tool", site) is passing


def test_a_rule_on_parameters_alone_is_not_transient() -> None:
    site = configuration().site
    assert is_transient_denial([Reason("AE750", "separation", "near")], "move", site)
    assert not is_transient_denial([Reason("AE750", "top-speed", "fast")], "move", site)
    assert not is_transient_denial([Reason("AE750", "others", "unknown")], "move", site)


@pytest.mark.parametrize(("at_most", "passing"), [(0, False), (1, True), (3, True)])
def test_a_quota_that_is_used_up_is_transient_unless_it_allows_nothing(at_most: int, passing: bool) -> None:
    site = configuration().site
    (quota,) = site.quotas
    limited = replace(site, quotas=(replace(quota, max_count=at_most),))
    assert is_transient_denial([Reason("AE742", quota.id, "used up")], "carry", limited) is passing
