"""Goals on the bus are steps like any other: decided by the gate, ended by the executor's one clean-up."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.bus import skill_action_server
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import ExecuteSkillFeedback, ExecuteSkillGoal, ExecuteSkillResult
from aeros.runtime.bus.port import ClientGoal, GoalStatus, NoServerError
from aeros.runtime.bus.skill_action_server import EXECUTE, EXECUTE_SKILL, MAX_GOALS, serve_goals
from aeros.runtime.execution.governor import FixedGovernor, OperatorCommand
from aeros.skill import Inputs, Observation, SkillBody, act
from tests.unit.runtime.together import Asking, Cart, asking, configuration, move, roll

Client = ClientGoal[ExecuteSkillFeedback, ExecuteSkillResult]
_LONG = 10.0


class Operated(FixedGovernor):
    """One configuration, and an operator."""

    current = OperatorCommand.RUN

    @property
    def command(self) -> OperatorCommand:
        return self.current


class Robot(Cart):
    """A cart whose executor pursues goals in a thread."""

    def __init__(self, log: Path, bodies: dict[str, Asking]) -> None:
        self.operator = Operated(configuration())
        super().__init__(log, bodies, governor=self.operator)
        self.bus = InProcessBus()
        self.raised: list[BaseException] = []

    def want(self, skill: str, inputs: str = "{}", module: str = "cart") -> Client:
        return self.bus.send_goal(EXECUTE_SKILL, EXECUTE, ExecuteSkillGoal(module, skill, inputs))

    @contextmanager
    def pursuing(self) -> Iterator[None]:
        server, over = self.bus.serve_action(EXECUTE_SKILL, EXECUTE), threading.Event()

        def run() -> None:
            try:
                serve_goals(server, self.executor, over.is_set)
            except BaseException as raised:
                self.raised.append(raised)

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join(_LONG)
            assert not thread.is_alive()


MakeRobot = Callable[..., Robot]


@pytest.fixture
def make_robot(tmp_path: Path) -> Iterator[MakeRobot]:
    made: list[Robot] = []

    def make(**bodies: Asking) -> Robot:
        robot = Robot(tmp_path / "audit.jsonl", bodies)
        made.append(robot)
        return robot

    yield make
    for robot in made:
        robot.assert_nothing_is_held()
        robot.audit.close()


def endless(*, ends: list[str]) -> Asking:
    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            while True:
                yield move()
        finally:
            ends.append("closed")

    return body


def test_a_goal_is_a_step_and_succeeds_when_its_skill_finishes(make_robot: MakeRobot) -> None:
    robot = make_robot(reach=asking(move(), move()))
    with robot.pursuing():
        goal = robot.want("reach")
        assert goal.result(_LONG) == ExecuteSkillResult("finished", "", allowed=2)
    assert goal.status is GoalStatus.SUCCEEDED
    assert robot.started_kinds() == ["move", "move"]
    assert [one["status"] for one in robot.records("step-ended")] == ["finished"]


def test_the_result_has_the_outputs_of_the_skill(make_robot: MakeRobot) -> None:
    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("wait", duration=1.0)
        return {"amount": 0.25}

    robot = make_robot(look=body)
    with robot.pursuing():
        result = robot.want("look").result(_LONG)
    assert (result.status, result.outputs) == ("finished", '{"amount":0.25}')


def test_a_goal_whose_action_the_gate_denies_moves_nothing(make_robot: MakeRobot) -> None:
    robot = make_robot(reach=asking(move(speed=1000.0)))
    with robot.pursuing():
        goal = robot.want("reach")
        result = goal.result(_LONG)
    assert (result.status, result.allowed, result.denied) == ("denied", 0, 1)
    assert "AE7" in result.reason
    assert goal.status is GoalStatus.ABORTED
    assert robot.started_kinds() == []
    assert [one["verdict"] for one in robot.records("decision")] == ["DENY"]


def test_goals_that_share_nothing_are_under_way_together(make_robot: MakeRobot) -> None:
    robot = make_robot(reach=asking(move()), drive=asking(roll()))
    server = robot.bus.serve_action(EXECUTE_SKILL, EXECUTE)
    goals = [robot.want("reach"), robot.want("drive")]
    serve_goals(server, robot.executor, lambda: all(goal.status.is_over for goal in goals))
    assert [goal.result(0.0).status for goal in goals] == ["finished", "finished"]
    began = [one["skill"] for one in robot.records("step-began")]
    ended = [one["sequence"] for one in robot.records("step-ended")]
    assert began == ["reach", "drive"]
    assert max(one["sequence"] for one in robot.records("step-began")) < min(ended)


@pytest.mark.parametrize(
    ("inputs", "why"),
    [
        ("", "the inputs are not JSON"),
        ("[]", "the inputs are not a JSON object"),
        ('{"a": 1, "a": 2}', "an input is given twice"),
        ('{"a": NaN}', "`NaN` is not a JSON number"),
        ("[" * 200_000, "the inputs are nested too deeply"),
        ('{"a": 1}', "the skill has no input `a`"),
    ],
)
def test_inputs_that_are_none_are_refused_and_the_refusal_recorded(
    inputs: str, why: str, make_robot: MakeRobot
) -> None:
    robot = make_robot(reach=asking(move()))
    with robot.pursuing():
        goal = robot.want("reach", inputs)
        result = goal.result(_LONG)
    assert (result.status, goal.status) == ("refused", GoalStatus.ABORTED)
    assert result.reason.startswith(why)
    assert robot.plant.calls == []
    refused = robot.records("step-refused") or [one["details"] for one in robot.records("note")]
    assert [one["reason"] for one in refused] == [result.reason]


def test_an_unknown_skill_is_refused(make_robot: MakeRobot) -> None:
    robot = make_robot()
    with robot.pursuing():
        assert robot.want("fly").result(_LONG).reason == "module `cart` has no skill `fly`"
        assert robot.want("reach", module="plane").result(_LONG).status == "refused"


def test_a_cancelled_goal_is_halted_once_and_says_so(make_robot: MakeRobot) -> None:
    ends: list[str] = []
    robot = make_robot(reach=endless(ends=ends))
    with robot.pursuing():
        goal = robot.want("reach")
        assert goal.feedback(_LONG) is not None
        goal.cancel()
        result = goal.result(_LONG)
    assert (result.status, goal.status) == ("cancelled", GoalStatus.CANCELED)
    assert result.reason == "cancelled by the client"
    assert ends == ["closed"]
    assert robot.plant.call_count("skill_ended") == 1


def test_a_goal_can_be_cancelled_while_the_operator_pauses(make_robot: MakeRobot) -> None:
    robot = make_robot(reach=asking(move()))
    robot.operator.current = OperatorCommand.PAUSE
    with robot.pursuing():
        goal = robot.want("reach")
        goal.cancel()
        assert goal.result(_LONG).status == "cancelled"
    assert robot.started_kinds() == []


def test_feedback_says_what_was_decided_so_far(make_robot: MakeRobot) -> None:
    ends: list[str] = []
    robot = make_robot(reach=endless(ends=ends))
    with robot.pursuing():
        goal = robot.want("reach")
        heard = [goal.feedback(_LONG), goal.feedback(_LONG)]
        counts = [one.allowed for one in heard if one is not None]
        goal.cancel()
        assert goal.result(_LONG).allowed >= counts[1] > counts[0] > 0


def test_when_the_server_closes_every_goal_has_a_result(make_robot: MakeRobot) -> None:
    ends: list[str] = []
    robot = make_robot(reach=endless(ends=ends))
    with robot.pursuing():
        goal = robot.want("reach")
        assert goal.feedback(_LONG) is not None
    result = goal.result(0.0)
    assert (result.status, goal.status) == ("cancelled", GoalStatus.ABORTED)
    assert result.reason == "the action server is closing"
    with pytest.raises(NoServerError):
        robot.want("reach")


def test_an_error_of_the_plant_is_raised_and_aborts_the_goals(make_robot: MakeRobot) -> None:
    robot = make_robot(reach=asking(move()))
    robot.plant.failing["begin"] = RuntimeError("a wire is loose")
    with robot.pursuing():
        goal = robot.want("reach")
        goal.result(_LONG)
    assert goal.status is GoalStatus.ABORTED
    assert [str(one) for one in robot.raised] == ["a wire is loose"]


def test_no_more_goals_are_taken_than_there_is_room_for(
    make_robot: MakeRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(skill_action_server, "MAX_GOALS", 2)
    assert MAX_GOALS > 2
    robot = make_robot(look=asking(*[act("wait", duration=1.0)] * 3))
    most: list[int] = []

    class Counting:
        """The executor, noting how many steps there are."""

        def __getattr__(self, name: str) -> Any:
            most.append(len(robot.executor._table.steps))
            return getattr(robot.executor, name)

    server = robot.bus.serve_action(EXECUTE_SKILL, EXECUTE)
    goals = [robot.want("look") for _ in range(6)]
    runtime: Any = Counting()
    serve_goals(server, runtime, lambda: all(goal.status.is_over for goal in goals))
    assert {goal.result(0.0).status for goal in goals} == {"finished"}
    assert max(most) == 2
