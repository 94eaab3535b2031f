"""Handlers that the failure of a step may lead to."""

from __future__ import annotations

from aeros.spec.model.composition import STOP_ON_FAILURE, Step, handlers_of
from tests.unit.agent.dumplings import SPAN


def _step(name: str, between: str | None = None, last: str | None = None) -> Step:
    return Step(name, name, {}, {}, 1, between, last, SPAN)


def test_a_step_that_stops_or_declares_nothing_has_no_handler() -> None:
    assert _step("fetch").handlers == ()
    assert _step("fetch", last=STOP_ON_FAILURE).handlers == ()
    assert _step("fetch", last=STOP_ON_FAILURE).last_handler is None
    assert _step("fetch", last="park").last_handler == "park"
    assert _step("fetch", "rest", "park").handlers == ("rest", "park")
    assert _step("fetch", "park", "park").handlers == ("park",)


def test_handlers_are_given_in_the_order_they_run() -> None:
    handlers = {"park": _step("park", "rest"), "rest": _step("rest", None, "stop"), "other": _step("other")}
    assert [one.id for one in handlers_of(_step("fetch", "park"), handlers)] == ["park", "rest"]
    both = handlers_of(_step("fetch", "park", "other"), handlers)
    assert [one.id for one in both] == ["park", "rest", "other"]
    assert [one.id for one in handlers_of(_step("fetch", "other"), handlers)] == ["other"]
    assert list(handlers_of(_step("fetch", None), handlers)) == []


def test_handlers_that_lead_back_are_given_once() -> None:
    handlers = {"park": _step("park", "rest"), "rest": _step("rest", "park")}
    assert [one.id for one in handlers_of(_step("fetch", "park"), handlers)] == ["park", "rest"]
    itself = {"park": _step("park", "park")}
    assert [one.id for one in handlers_of(itself["park"], itself)] == ["park"]
