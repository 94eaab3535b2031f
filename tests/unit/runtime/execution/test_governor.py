"""The configuration in force, and what an operator does to steps that are active."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace

from aeros.runtime.execution.governor import FixedGovernor, FollowedConfiguration, OperatorCommand
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


def test_a_fixed_configuration_is_the_first_and_the_last() -> None:
    governor = FixedGovernor(configuration())
    assert governor.generation == 0
    assert governor.command is OperatorCommand.RUN
    assert governor.configuration() == (0, configuration())
    assert governor.revocation_reason("cart", "reach", "move") is None
    with governor.hold_generation(0) as is_first, governor.hold_generation(1) as is_other:
        assert (is_first, is_other) == (True, False)


class _Counting(Operator):
    """Counts how often its configuration is asked for, and how many generations are held now."""

    asked = 0

    def configuration(self) -> tuple[int, Configuration]:
        self.asked += 1
        return super().configuration()

    @contextmanager
    def _hold(self, generation: int) -> Iterator[bool]:
        self.held += 1
        yield generation == self.generation
        self.held -= 1

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        return self._hold(generation)


class _Follower:
    """A followed configuration, and what happens to whoever follows it."""

    def __init__(self) -> None:
        self.operator = _Counting()
        self.is_moving = False
        self.events: list[tuple[str, str]] = []
        self.followed = FollowedConfiguration(
            configuration(),
            self.operator,
            lambda: self.is_moving,
            lambda new: self.events.append(("switch", new.digest[0])),
            lambda new: self.events.append(("record", new.digest[0])),
        )

    def change(self, digest: str) -> None:
        self.operator.generation += 1
        self.operator.in_force = replace(configuration(), digest=digest * 64)


def test_a_configuration_is_read_once_in_each_generation() -> None:
    one = _Follower()
    assert (one.followed.generation, one.followed.follow(), one.followed.follow()) == (None, 0, 0)
    assert (one.operator.asked, one.events) == (1, [])


def test_a_changed_configuration_is_switched_to_and_then_recorded() -> None:
    one = _Follower()
    one.followed.follow()
    one.change("d")
    assert one.followed.follow() == 1
    assert one.events == [("switch", "d"), ("record", "d")]
    assert one.followed.configuration.digest == "d" * 64


def test_an_equal_configuration_of_another_generation_is_no_change() -> None:
    one = _Follower()
    one.followed.follow()
    one.change("c")
    assert one.followed.follow() == 1
    assert one.events == []


def test_a_change_waits_for_what_moves() -> None:
    one = _Follower()
    assert one.followed.is_latest()
    one.change("d")
    one.is_moving = True
    assert one.followed.follow() == 0
    assert not one.followed.is_latest()
    one.is_moving = False
    assert one.followed.is_latest()


def test_a_first_look_reads_the_configuration_although_something_moves() -> None:
    one = _Follower()
    one.is_moving = True
    one.change("d")
    assert one.followed.follow() == 1
    assert one.events == [("switch", "d"), ("record", "d")]


def test_a_module_is_active_while_manifest_and_code_are_the_same() -> None:
    one = _Follower()
    cart = configuration().modules["cart"]
    assert one.followed.is_active(cart)
    assert one.followed.is_active(replace(cart))
    assert not one.followed.is_active(replace(cart, manifest_digest="other"))
    assert not one.followed.is_active(replace(cart, code_digest="other"))
    assert not one.followed.is_active(replace(cart, id="other"))


def test_a_generation_is_held_until_nothing_moves() -> None:
    one = _Follower()
    one.followed.release()
    assert one.followed.hold()
    one.is_moving = True
    one.followed.release()
    assert one.operator.held == 1
    assert one.followed.hold()
    assert one.operator.held == 1
    one.is_moving = False
    one.followed.release()
    one.followed.release()
    assert one.operator.held == 0


def test_a_hold_while_something_moves_tells_of_a_change() -> None:
    one = _Follower()
    assert one.followed.hold()
    one.is_moving = True
    one.change("d")
    assert not one.followed.hold()
