"""The configuration in force, and what an operator does to steps that are active."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace

from aeros.runtime.execution.governor import FixedGovernor, FollowedConfiguration, OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from tests.unit.runtime.together import Operator, configuration


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
    """A followed configuration, and its effects on its follower."""

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


def test_a_hold_while_something_moves_reports_a_change() -> None:
    one = _Follower()
    assert one.followed.hold()
    one.is_moving = True
    one.change("d")
    assert not one.followed.hold()
