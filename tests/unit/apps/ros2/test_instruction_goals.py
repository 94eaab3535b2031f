"""An instruction from the bus is pursued as one from the terminal, and its client can cancel it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.execution.journal import AgentEvent
from aeros.agent.instructions.refusals import InstructionError
from aeros.apps.ros2.instruction_goals import PURSUE, PURSUIT, InstructionGoals
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import PursueFeedback, PursueGoal, PursueResult
from aeros.runtime.bus.port import ClientGoal, GoalStatus

Client = ClientGoal[PursueFeedback, PursueResult]


def report(*, reached: bool, reason: str | None = None) -> SimpleNamespace:
    return SimpleNamespace(
        reached=reached,
        reason=reason,
        measured={"door": 1},
        steps=("a", "b"),
        allowed=3,
        attenuated=1,
        denied=0,
        has_failed=reason is not None,
    )


class Notes:
    """Runtime that keeps its notes."""

    def __init__(self) -> None:
        self.notes: list[tuple[str, Mapping[str, Any]]] = []

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        self.notes.append((event, details))


class Pursuing:
    """Agent that does what `does` says when it is given an instruction."""

    def __init__(self, does: Callable[[Any, float | None], Any]) -> None:
        self.is_cancelled: Callable[[], bool] | None = None
        self.run = does


def asked(agent: Any, goal: PursueGoal, understand: Callable[[str], Any] = lambda text: text) -> Any:
    """The client's end of a goal after a turn of the server, and the notes."""
    bus, notes = InProcessBus(), Notes()
    goals = InstructionGoals(bus.serve_action(PURSUE, PURSUIT), understand)
    client = bus.send_goal(PURSUE, PURSUIT, goal)
    goals.take_turn(agent, notes, 0.0)  # type: ignore[arg-type]
    goals.close()
    return client, notes.notes


def test_an_instruction_that_is_reached_succeeds() -> None:
    seen: list[Any] = []

    def run(meaning: Any, timeout: float | None) -> Any:
        seen.append((meaning, timeout))
        return report(reached=True)

    client, notes = asked(Pursuing(run), PursueGoal("open the door", 5.0))
    assert seen == [("open the door", 5.0)]
    assert client.status is GoalStatus.SUCCEEDED
    assert client.result(0.0) == PursueResult(True, "", '{"door":1}', 2, 3, 1, 0)
    assert notes == [("goal-requested", {"instruction": "open the door", "clients": []})]


def test_no_limit_is_given_as_zero() -> None:
    def run(_meaning: Any, timeout: float | None) -> Any:
        assert timeout is None
        return report(reached=True)

    client, _ = asked(Pursuing(run), PursueGoal("open the door"))
    assert client.status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize("timeout", [-1.0, math.nan, math.inf])
def test_a_time_limit_that_is_none_is_refused(timeout: float) -> None:
    goal = PursueGoal("open the door", timeout)
    client, notes = asked(Pursuing(lambda *_: pytest.fail("it ran")), goal)
    assert client.status is GoalStatus.ABORTED
    assert "give 0 for no limit" in client.result(1.0).reason
    assert [event for event, _ in notes] == ["goal-requested", "goal-rejected"]


def test_an_instruction_that_is_not_understood_is_refused_with_the_reason() -> None:
    def understand(text: str) -> Any:
        raise InstructionError(f"nobody knows `{text}`")

    client, notes = asked(Pursuing(lambda *_: pytest.fail("it ran")), PursueGoal("fly"), understand)
    assert client.status is GoalStatus.ABORTED
    assert client.result(0.0).reason == "nobody knows `fly`"
    assert [event for event, _ in notes] == ["goal-requested", "goal-rejected"]


def test_a_goal_that_is_given_up_is_aborted_with_the_reason() -> None:
    client, _ = asked(Pursuing(lambda *_: report(reached=False, reason="no way")), PursueGoal("open"))
    assert (client.status, client.result(0.0).reason) == (GoalStatus.ABORTED, "no way")


def test_an_agent_that_refuses_ends_the_goal() -> None:
    def run(*_: Any) -> Any:
        raise AgentError("in quarantine")

    client, _ = asked(Pursuing(run), PursueGoal("open"))
    assert (client.status, client.result(0.0).reason) == (GoalStatus.ABORTED, "in quarantine")


def test_events_are_feedback_and_a_cancelled_goal_ends_as_cancelled() -> None:
    bus, notes = InProcessBus(), Notes()
    goals = InstructionGoals(bus.serve_action(PURSUE, PURSUIT), lambda text: text)  # type: ignore[arg-type,return-value]
    client = bus.send_goal(PURSUE, PURSUIT, PursueGoal("open"))

    def run(*_: Any) -> Any:
        goals.on_event(AgentEvent("step-began", "opens", {}, 0.0))
        assert client.feedback() == PursueFeedback("step-began", "opens")
        assert agent.is_cancelled is not None
        assert not agent.is_cancelled()
        client.cancel()
        assert agent.is_cancelled()
        return report(reached=False, reason="cancelled by the client")

    agent = Pursuing(run)
    goals.take_turn(agent, notes, 0.0)  # type: ignore[arg-type]
    assert client.status is GoalStatus.CANCELED
    assert agent.is_cancelled is None
    goals.on_event(AgentEvent("idle", "nobody listens", {}, 0.0))
    assert client.feedback() is None
