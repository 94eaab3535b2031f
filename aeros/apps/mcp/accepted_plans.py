"""Accepted plans of clients, each with its request for approval, until they are executed or discarded."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from aeros.apps.mcp.approvals import Approval, Approvals
from aeros.apps.mcp.plan_review import ClientPlan
from aeros.apps.mcp.tool_arguments import ToolCallError
from aeros.spec.model.policy import Execute

MAX_PLANS: Final = 32


@dataclass(slots=True)
class AcceptedPlan:
    """An accepted plan.

    Attributes:
        id: Random id, which the client names to execute the plan.
        plan: The plan.
        approval: Id of its request for approval; None before there is one.
    """

    id: str
    plan: ClientPlan
    approval: str | None = None


class AcceptedPlans:
    """At most `MAX_PLANS` accepted plans; the oldest makes room for a new one.  Not thread-safe.

    Args:
        approvals: Requests to the operator.
    """

    def __init__(self, approvals: Approvals) -> None:
        self._approvals = approvals
        self._plans: dict[str, AcceptedPlan] = {}

    def __iter__(self) -> Iterator[str]:
        return iter(self._plans)

    def add(self, plan: ClientPlan) -> str:
        """Keep an accepted plan.

        Args:
            plan: The plan.

        Returns:
            Its id.
        """
        while len(self._plans) >= MAX_PLANS:
            self.discard(next(iter(self._plans)))
        id_ = secrets.token_hex(4)
        self._plans[id_] = AcceptedPlan(id_, plan)
        return id_

    def find(self, id_: str) -> AcceptedPlan:
        """Return a plan that is kept.

        Args:
            id_: Id of the plan.

        Returns:
            The plan.

        Raises:
            ToolCallError: There is no such plan; it was executed, discarded or never accepted.
        """
        kept = self._plans.get(id_)
        if kept is None:
            raise ToolCallError("unknown plan; call propose_plan first")
        return kept

    def take(self, id_: str) -> None:
        """Remove a plan that is about to be executed; nobody can execute it again.

        Args:
            id_: Id of the plan.
        """
        del self._plans[id_]

    def discard(self, id_: str) -> None:
        """Remove a plan and its request for approval.

        Args:
            id_: Id of the plan.
        """
        kept = self._plans.pop(id_)
        if kept.approval is not None:
            self._approvals.withdraw(kept.approval)

    def discard_if_kept(self, id_: str | None) -> None:
        """Remove a plan and its request for approval, if the plan is kept.

        Args:
            id_: Id of the plan; None for no plan.
        """
        if id_ in self._plans:
            self.discard(str(id_))

    def discard_all(self) -> None:
        """Remove all plans, and all requests for approval."""
        for id_ in list(self._plans):
            self.discard(id_)
        self._approvals.withdraw_all()

    def is_decided(self, id_: str) -> bool:
        """Check if the operator has approved or rejected a plan, or it is not kept.

        Args:
            id_: Id of the plan.

        Returns:
            True if there is nothing left to ask.
        """
        kept = self._plans.get(id_)
        return kept is None or self._approvals.is_decided(kept.approval)

    def approval_of(
        self, kept: AcceptedPlan, execute: Execute, client: str, answer: bool | None
    ) -> Approval | None:
        """Use the approval of a plan, by the operator or, if the site says so, by the client's user.

        A rejection of the operator stands above any answer of the client.

        Args:
            kept: The plan.
            execute: The site's rule.
            client: The client's name, as it gives it.
            answer: Answer of the client's user, as the client says; None if there is none.

        Returns:
            The approval, which is void from then on; None if there is none yet.

        Raises:
            ToolCallError: The operator or the client's user rejected the plan.
        """
        if self._approvals.is_rejected(kept.approval):
            self.discard(kept.id)
            raise ToolCallError("the operator did not approve it; propose a plan again")
        approval = self._approvals.consume(kept.approval)
        if approval is not None or execute is not Execute.ELICITATION or answer is None:
            return approval
        if not answer:
            self.discard(kept.id)
            raise ToolCallError("the client's user did not approve it; propose a plan again")
        return self._approvals.consume_claimed(kept.approval, f"the user of {client}, as the client says")

    def request_approval(self, kept: AcceptedPlan, what: Mapping[str, Any]) -> str:
        """Write a request for the operator, unless the plan has one.

        Args:
            kept: The plan.
            what: Content of the request, JSON values.

        Returns:
            Id of the request.

        Raises:
            ApprovalError: Too many requests are pending.
        """
        kept.approval = self._approvals.request(what, kept.approval)
        return kept.approval
