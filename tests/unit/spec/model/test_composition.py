"""Handlers that the failure of a step may lead to."""

from __future__ import annotations

from aeros.spec.expr import terms as t
from aeros.spec.model.composition import (
    STOP_ON_FAILURE,
    Composition,
    OutputReference,
    Step,
    handler_cycle,
    handlers_of,
    nested,
)
from aeros.spec.model.step_graph import NestedIf, Seq, steps_of
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


def test_a_nested_composition_has_names_and_flows_of_its_own() -> None:
    flows = {"width": OutputReference("look", "width", SPAN)}
    flowing = Step("tidy", "tidy", {}, flows, 1, "rest", STOP_ON_FAILURE, SPAN)
    body = Seq((_step("look", last="park"), flowing))
    handlers = {"rest": _step("rest", None, "park"), "park": _step("park")}
    part, renamed = nested("clean", Composition("c", t.TRUE, None, body, handlers, SPAN), SPAN)
    look, tidy = steps_of(part)
    assert (look.id, look.skill, look.on_failure) == ("clean.look", "look", "clean.park")
    assert (tidy.id, tidy.between_tries, tidy.on_failure) == ("clean.tidy", "clean.rest", STOP_ON_FAILURE)
    assert tidy.output_references["width"].step == "clean.look"
    assert {name: one.id for name, one in renamed.items()} == {
        "clean.rest": "clean.rest",
        "clean.park": "clean.park",
    }
    assert renamed["clean.rest"].on_failure == "clean.park"
    assert all(one.is_nested for one in (look, tidy, *renamed.values()))


def test_a_nested_composition_fails_where_its_precondition_does_not_hold() -> None:
    part, _ = nested("clean", Composition("c", t.FALSE, SPAN, _step("look"), {}, SPAN), SPAN)
    assert isinstance(part, NestedIf)
    assert (part.condition, part.otherwise, part.is_precondition) == (t.FALSE, None, True)


def _composition(body: Step, **handlers: Step) -> Composition:
    return Composition("c", t.TRUE, None, body, handlers, SPAN)


def test_handlers_in_a_circle_are_found() -> None:
    found = handler_cycle(_composition(_step("a", "h"), h=_step("h", "i"), i=_step("i", "h")))
    assert found[0] == found[-1]
    assert set(found) == {"h", "i"}
    assert handler_cycle(_composition(_step("a", "h"), h=_step("h", "i"), i=_step("i"))) == []
    assert handler_cycle(_composition(_step("a"))) == []
