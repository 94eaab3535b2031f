"""The configuration in force, and what an operator does to steps that are active."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import StepResult, StepStatus
from tests.unit.runtime.together import MakeCart, asking, configuration, move, roll


class Operator:
    """A governor in the test's hands."""

    def __init__(self) -> None:
        self.generation = 0
        self.command = OperatorCommand.RUN
        self.revoked: set[str] = set()
        self.in_force = configuration()
        self.held = 0

    def configuration(self) -> tuple[int, Configuration]:
        return self.generation, self.in_force

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        return nullcontext(generation == self.generation)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        return "the test says so" if skill in self.revoked else None


def test_what_the_operator_revokes_is_halted_and_the_other_goes_on(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.generation, operator.revoked = 1, {"reach"}
    results = one.ends(2)
    assert results[reach] == StepResult(StepStatus.STOPPED, "revoked: the test says so", allowed=1)
    assert results[drive].status is StepStatus.FINISHED
    one.assert_nothing_is_held()


def test_under_another_configuration_nothing_begins_before_what_moves_has_ended(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.generation = 1
    operator.in_force = Configuration(configuration().site, configuration().modules, {}, "d" * 64)
    one.ends(2)
    seen = [record["configuration"][0] for record in one.records("decision")]
    times = [record["time"] for record in one.records("decision")]
    assert list(zip(seen, times, strict=True))[:4] == [("c", 0.0), ("c", 0.0), ("d", 3.0), ("d", 3.0)]


def test_while_the_operator_pauses_what_moves_ends_and_nothing_begins(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.command = OperatorCommand.PAUSE
    assert one.executor.wait(3.0) is None
    assert one.begun() == ["move", "roll"]
    operator.command = OperatorCommand.RUN
    assert {result.status for result in one.ends(2).values()} == {StepStatus.FINISHED}
    assert [len(one.records(event)) for event in ("paused", "resumed")] == [1, 1]


def test_a_stop_by_the_operator_ends_everything(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.command = OperatorCommand.STOP
    assert one.executor.is_stopped
    ended = one.ends(2).values()
    assert {(one.status, one.reason) for one in ended} == {(StepStatus.HALTED, "stopped by the operator")}
    one.assert_nothing_is_held()
