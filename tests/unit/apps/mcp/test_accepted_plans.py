"""Accepted plans: kept up to a number, approved by whom the site says, executed or discarded once."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.agent.planning.routing import RoutedTask
from aeros.apps.mcp.accepted_plans import MAX_PLANS, AcceptedPlans
from aeros.apps.mcp.approvals import Approvals, approve, reject
from aeros.apps.mcp.plan_review import ClientPlan
from aeros.apps.mcp.tool_arguments import ProposedStep, ToolCallError
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.policy import Execute
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, SPAN, term

ROUTED = RoutedTask("dumpling", MAKE_DUMPLINGS)
GOAL = ActionCondition(term("dough_on_workspace"), "dough_on_workspace", SPAN)
PLAN = ClientPlan((ProposedStep("dumpling.prepare", {}),), GOAL, ROUTED)


@pytest.fixture
def approvals(tmp_path: Path) -> Approvals:
    return Approvals(tmp_path)


def test_the_oldest_plan_makes_room_and_its_request_is_withdrawn(approvals: Approvals) -> None:
    plans = AcceptedPlans(approvals)
    first = plans.add(PLAN)
    plans.request_approval(plans.find(first), {"what": "execute"})
    others = [plans.add(PLAN) for _ in range(MAX_PLANS)]
    assert (list(plans), approvals.pending) == (others, [])
    with pytest.raises(ToolCallError, match="unknown plan"):
        plans.find(first)


def test_a_plan_that_is_taken_or_discarded_is_gone(approvals: Approvals) -> None:
    plans = AcceptedPlans(approvals)
    taken, kept = plans.add(PLAN), plans.add(PLAN)
    plans.take(taken)
    plans.discard_if_kept(taken)
    plans.discard_if_kept(None)
    assert list(plans) == [kept]
    plans.request_approval(plans.find(kept), {"what": "execute"})
    approvals.request({"what": "resume"})
    plans.discard_all()
    assert (list(plans), approvals.pending) == ([], [])


@pytest.mark.parametrize(
    ("execute", "answer", "by"),
    [
        (Execute.APPROVAL, None, None),
        (Execute.APPROVAL, True, None),
        (Execute.APPROVAL, False, None),
        (Execute.ELICITATION, None, None),
        (Execute.ELICITATION, True, "the user of c, as the client says"),
    ],
)
def test_the_answer_of_a_clients_user_counts_only_where_the_site_says_so(
    execute: Execute, answer: bool | None, by: str | None, approvals: Approvals
) -> None:
    plans = AcceptedPlans(approvals)
    kept = plans.find(plans.add(PLAN))
    assert plans.approval_of(kept, execute, "c", answer) is None  # nobody was asked yet
    plans.request_approval(kept, {"what": "execute"})
    found = plans.approval_of(kept, execute, "c", answer)
    assert (None if found is None else (found.approved_by, found.is_verified)) == (by and (by, False))


def test_a_rejection_by_the_operator_or_the_user_discards_the_plan(
    tmp_path: Path, approvals: Approvals
) -> None:
    plans = AcceptedPlans(approvals)
    kept = plans.find(plans.add(PLAN))
    reject(tmp_path, plans.request_approval(kept, {"what": "execute"}))
    assert plans.is_decided(kept.id)
    with pytest.raises(ToolCallError, match="the operator did not approve it"):
        plans.approval_of(kept, Execute.ELICITATION, "c", answer=True)
    other = plans.find(plans.add(PLAN))
    plans.request_approval(other, {"what": "execute"})
    assert not plans.is_decided(other.id)
    with pytest.raises(ToolCallError, match="the client's user did not approve it"):
        plans.approval_of(other, Execute.ELICITATION, "c", answer=False)
    assert plans.is_decided(other.id)
    assert list(plans) == []


def test_the_operators_yes_counts_before_the_no_of_a_clients_user(
    tmp_path: Path, approvals: Approvals
) -> None:
    plans = AcceptedPlans(approvals)
    kept = plans.find(plans.add(PLAN))
    approve(tmp_path, plans.request_approval(kept, {"what": "execute"}))
    assert plans.is_decided(kept.id)
    found = plans.approval_of(kept, Execute.ELICITATION, "c", answer=False)
    assert found is not None
    assert found.is_verified
