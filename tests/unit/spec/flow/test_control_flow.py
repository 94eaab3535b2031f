from __future__ import annotations

from fractions import Fraction

from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.flow.control_flow import DONE, START, STOPPED, control_flow_graph
from aeros.spec.model.composition import Composition, Part, Step, handlers_of
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
    steps_of,
)

TEXT = Source("text", "x" * 100)


def step(name: str, retry: int = 0, between: str | None = None, last: str | None = None) -> Step:
    return Step(name, name, {}, {}, retry, between, last, TEXT.span(0, 1))


def composition(body: Part, **handlers: Step) -> Composition:
    return Composition("c", t.TRUE, None, body, handlers, TEXT.span(0, 1))


def edges(one: Composition) -> set[tuple[str, str, str]]:
    return {(before, after, data["on"]) for before, after, data in control_flow_graph(one).edges(data=True)}


def test_a_sequence_leads_from_step_to_step() -> None:
    assert edges(composition(Seq((step("a"), step("b"))))) == {
        (START, "step/a", ""),
        ("step/a", "step/b", "success"),
        ("step/b", DONE, "success"),
        ("step/a", STOPPED, "failure"),
        ("step/b", STOPPED, "failure"),
    }


def test_branches_part_and_meet() -> None:
    found = edges(composition(Par((step("a"), step("b")), TEXT.span(7, 8))))
    assert {(START, "fork@3", ""), ("fork@3", "step/a", ""), ("fork@3", "step/b", "")} < found
    assert {("step/a", "join@3", "success"), ("step/b", "join@3", "success"), ("join@3", DONE, "")} < found


def test_a_condition_leads_to_either_part() -> None:
    one = If(t.TRUE, "c", step("a"), Seq(()), TEXT.span(3, 4))
    assert {("if/c@3", "step/a", "then"), ("if/c@3", DONE, "else")} < edges(composition(one))


def test_a_handler_leads_back_to_the_step() -> None:
    found = edges(composition(step("a", 1, "h"), h=step("h")))
    assert {("step/a", "handler/h", "failure"), ("handler/h", "step/a", "success")} < found
    assert ("handler/h", STOPPED, "failure") in found


def test_a_handler_after_the_last_try_leads_to_the_end() -> None:
    found = edges(composition(step("a", 1, last="h"), h=step("h")))
    assert {("step/a", "handler/h", "last failure"), ("handler/h", STOPPED, "")} < found
    assert {("step/a", "step/a", "failure")} < found
    assert not {("step/a", STOPPED, "failure"), ("handler/h", "step/a", "success")} & found


def test_a_retry_without_a_handler_leads_to_itself() -> None:
    assert ("step/a", "step/a", "failure") in edges(composition(step("a", 1)))


def test_the_handlers_of_a_step_are_those_it_leads_to() -> None:
    handlers = {"h": step("h", 1, "i"), "i": step("i"), "j": step("j")}
    assert [one.id for one in handlers_of(step("a", 1, "h"), handlers)] == ["h", "i"]
    assert list(handlers_of(step("a", 0, last="stop"), handlers)) == []
    body: Part = Seq((step("b"), step("a")))
    assert [one.id for one in steps_of(body)] == ["b", "a"]


def test_a_failure_leads_to_the_next_alternative() -> None:
    span = TEXT.span(3, 4)
    check: Part = If(t.TRUE, "c", Seq(()), FailingPart("c", span), span)
    either = Fallback((step("a", 1, last="h"), check, step("b")), span)
    found = edges(composition(Seq((either, step("z"))), h=step("h")))
    assert {("step/a", "step/z", "success"), ("step/a", "handler/h", "last failure")} < found
    assert {("handler/h", "if/c@5", ""), ("if/c@5", "step/z", "then"), ("if/c@5", "step/b", "else")} < found
    assert {("step/b", STOPPED, "failure"), ("step/b", "step/z", "success")} < found
    assert ("step/a", STOPPED, "failure") not in found


def test_a_tolerated_failure_and_another_try_of_a_part_have_nodes() -> None:
    span = TEXT.span(3, 4)
    tolerated = Fallback((step("a"), Seq(())), span)
    found = edges(composition(RetriedPart(Seq((tolerated, step("b"))), 2, span)))
    assert {(START, "tries@3", ""), ("tries@3", "step/a", ""), ("tries@3", STOPPED, "no try is left")} < found
    assert {("step/a", "tolerated@5", "failure"), ("tolerated@5", "step/b", "")} < found
    assert {("step/b", "tries@3", "failure"), ("step/b", DONE, "success")} < found


def test_a_part_that_may_be_stopped_fails_from_its_beginning_and_from_its_steps() -> None:
    span = step("a").span
    found = edges(composition(TimedPart(step("a"), span, True, Fraction(1))))
    assert {(START, "while@3", ""), ("while@3", "step/a", ""), ("step/a", STOPPED, "failure")} < found
    assert ("while@3", STOPPED, "at any time until its end") in found
