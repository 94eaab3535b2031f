"""Compositions of a module: graphs of steps, their inputs and handlers, and each fault at its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import pytest

from aeros.spec.declared import composition as declared
from aeros.spec.declared.decode import decode
from aeros.spec.declared.field_types import Named
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.elaborate.module.callables import CallableNames
from aeros.spec.elaborate.module.composition import elaborate_compositions
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import ForeignNames, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import FailingPart, Fallback, If, Par, RetriedPart, Seq
from tests.unit.spec.faults import CORPUS, TABLE
from tests.unit.spec.text.reading import accepted


@dataclass(frozen=True)
class _File:
    span: SourceSpan
    compositions: Named[declared.Composition]


@cache
def _site() -> Site:
    """The corpus's site, which allows two retries of a step."""
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    return site


@cache
def _skills() -> Mapping[str, Skill]:
    """`fetch`, `tidy` and `park` without inputs, `measure` with an output and `use` with an input."""
    skills: dict[str, Skill] = {}
    for case in ("handler_leads_to_the_next_try", "output_exactly_within_the_input"):
        loaded = load_ecm(CORPUS / "accepted" / case, _site(), Diagnostics())
        assert loaded is not None
        skills |= loaded.ecm.skills
    return skills


FORMS = "a part has exactly one of `seq`, `par`, `any`, `tolerate`, `if`, `check`, `hold`, `timeout`"


def _elaborated(text: str, name: str = "all") -> tuple[dict[str, Composition], list[Diagnostic]]:
    lines = "\n".join(f"    {line}" for line in ["description: a test", *text.splitlines()])
    sink = Diagnostics()
    file = decode(accepted(f"compositions:\n  {name}:\n{lines}\n"), _File, sink)
    assert file is not None, list(sink)
    names = CallableNames("module", _skills(), {}, {}, ForeignNames(), frozenset())
    return elaborate_compositions(file.compositions, _site(), names, sink), list(sink)


def _composed(text: str) -> Composition:
    found, message = _elaborated(text)
    assert message == []
    return found["all"]


def _refused(text: str) -> list[tuple[str, str]]:
    found, message = _elaborated(text)
    assert found == {}
    return [(one.code, one.headline) for one in message]


def _step(part: object) -> Step:
    assert isinstance(part, Step)
    return part


def test_steps_run_in_sequence_in_parallel_and_by_condition() -> None:
    body = _composed(
        "do:\n"
        "  seq:\n"
        "    - skill: fetch\n"
        "    - par: [{skill: park}, {skill: park, id: again}]\n"
        "    - {if: table_tidy, then: {skill: tidy}, else: nothing}\n"
    ).body
    assert isinstance(body, Seq)
    first, both, choice = body.parts
    assert (_step(first).id, _step(first).skill, _step(first).retry, _step(first).between_tries) == (
        "fetch",
        "fetch",
        0,
        None,
    )
    assert isinstance(both, Par)
    assert [(_step(one).id, _step(one).skill) for one in both.branches] == [
        ("park", "park"),
        ("again", "park"),
    ]
    assert both.span.text == "par: [{skill: park}, {skill: park, id: again}]"
    assert isinstance(choice, If)
    assert (choice.text, _step(choice.then).id, choice.otherwise) == ("table_tidy", "tidy", Seq(()))


def test_a_choice_may_have_a_part_or_none_for_otherwise() -> None:
    with_part = _composed("do: {if: table_tidy, then: {skill: park}, else: {skill: fetch}}").body
    without = _composed("do: {if: table_tidy, then: {skill: park}}").body
    assert isinstance(with_part, If)
    assert _step(with_part.otherwise).id == "fetch"
    assert isinstance(without, If)
    assert without.otherwise is None


def test_a_precondition_is_true_unless_it_is_written() -> None:
    bare = _composed("do: {skill: fetch}")
    assert (bare.id, bare.precondition, bare.precondition_span, dict(bare.handlers)) == (
        "all",
        t.TRUE,
        None,
        {},
    )
    guarded = _composed("do: {skill: fetch}\nprecondition: table_tidy")
    assert guarded.precondition == _site().state["table_tidy"].variable
    assert guarded.precondition_span is not None
    assert guarded.precondition_span.text == "table_tidy"


def test_inputs_are_constants_in_si_or_outputs_of_earlier_steps() -> None:
    body = _composed(
        "do:\n  seq:\n"
        "    - {skill: use, inputs: {gain: 250 mm}}\n"
        "    - {skill: measure}\n"
        "    - {skill: use, id: second, inputs: {gain: {from: measure.amount}}}\n"
    ).body
    assert isinstance(body, Seq)
    first, _, second = map(_step, body.parts)
    assert (first.inputs, dict(first.output_references)) == ({"gain": Fraction(1, 4)}, {})
    assert second.inputs == {}
    reference = second.output_references["gain"]
    assert (reference.step, reference.output, reference.span.text) == ("measure", "amount", "measure.amount")


def test_a_skill_that_handles_a_failure_becomes_a_handler() -> None:
    one = _composed("do: {skill: fetch, retry: 2, between_tries: park}")
    assert (_step(one.body).retry, _step(one.body).between_tries) == (2, "park")
    assert [(name, step.skill, step.retry) for name, step in one.handlers.items()] == [("park", "park", 0)]


def test_a_named_handler_has_its_own_inputs_and_retries() -> None:
    one = _composed(
        "do: {skill: fetch, retry: 1, between_tries: clear}\n"
        "handlers:\n  clear: {skill: use, inputs: {gain: 1 m}, retry: 1, on_failure: stop}\n"
    )
    (handler,) = one.handlers.values()
    assert (handler.id, handler.skill, handler.inputs) == ("clear", "use", {"gain": Fraction(1)})
    assert (handler.retry, handler.on_failure, handler.handlers) == (1, "stop", ())


def test_alternatives_tolerated_failures_checks_and_tries_of_a_part() -> None:
    body = _composed(
        "do:\n  seq:\n"
        "    - any: [{skill: fetch}, {check: table_tidy}, {skill: park, on_failure: stop}]\n"
        "    - tolerate: {skill: fetch, id: again}\n"
        "    - {retry: 2, seq: [{skill: use, inputs: {gain: 1 m}}]}\n"
        "    - {retry: 0, seq: [{skill: park, id: last}]}\n"
    ).body
    assert str(body).count(" or else ") == 3
    assert isinstance(body, Seq)
    either, tolerated, tried, once = body.parts
    assert isinstance(either, Fallback)
    check = either.parts[1]
    assert isinstance(check, If)
    assert (check.then, check.text) == (Seq(()), "table_tidy")
    assert isinstance(check.otherwise, FailingPart)
    assert isinstance(tolerated, Fallback)
    assert tolerated.parts[1] == Seq(())
    assert isinstance(tried, RetriedPart)
    assert (tried.retry, tried.span.text) == (2, "2")
    assert isinstance(once, Seq)


def test_a_failure_that_stops_needs_no_handler_and_no_retry() -> None:
    one = _composed("do: {skill: fetch, on_failure: stop}")
    assert _step(one.body).on_failure == "stop"
    assert dict(one.handlers) == {}


@pytest.mark.parametrize(
    ("do", "message"),
    [
        ("{}", ("AE102", f"{FORMS} and `skill`; found none of them")),
        (
            "{skill: fetch, seq: [{skill: park}]}",
            ("AE102", f"{FORMS} and `skill`; found `seq` and `skill`"),
        ),
        ("{any: [{skill: fetch}]}", ("AE112", "an `any` has at least two alternatives")),
        (
            "{par: [{skill: fetch}, {check: table_tidy}]}",
            ("AE112", "a branch of a `par` has at least one step"),
        ),
        ("{check: table_tidy}", ("AE112", "a composition has at least one step")),
        (
            "{any: [{skill: fetch, on_failure: stop}, {skill: park, on_failure: stop}]}",
            ("AE102", "`fetch` cannot stop the composition: the `any` around it goes on after its failure"),
        ),
        (
            "{tolerate: {seq: [{skill: fetch, on_failure: stop}]}}",
            (
                "AE102",
                "`fetch` cannot stop the composition: the `tolerate` around it goes on after its failure",
            ),
        ),
        (
            "{retry: 1, seq: [{skill: fetch, on_failure: stop}]}",
            (
                "AE102",
                "`fetch` cannot stop the composition: the `retry` around it tries again after its failure",
            ),
        ),
        ("{retry: 3, seq: [{skill: fetch}]}", ("AE129", "this site allows at most 2 retries of a step")),
        ("{par: [{skill: fetch}]}", ("AE112", "a `par` has at least two branches")),
        (
            "{seq: [{skill: fetch}], on_failure: park}",
            ("AE102", "`on_failure` belongs to a step with a `skill`"),
        ),
        ("{seq: [{skill: fetch}], id: one}", ("AE102", "`id` belongs to a step with a `skill`")),
        (
            "{skill: fetch, then: {skill: park}}",
            ("AE102", "`then` and `else` belong to an `if`"),
        ),
        ("{skill: fetch, else: nothing}", ("AE102", "`then` and `else` belong to an `if`")),
        ("{if: table_tidy}", ("AE102", "an `if` needs a `then`")),
        (
            "{seq: [{skill: fetch}, {skill: fetch}]}",
            ("AE120", "two steps of this composition are named `fetch`"),
        ),
        (
            "{if: table_tidy, then: {skill: fetch}, else: {skill: fetch}}",
            ("AE120", "two steps of this composition are named `fetch`"),
        ),
        ("{skill: fetch, retry: 3}", ("AE129", "this site allows at most 2 retries of a step")),
        (
            "{skill: fetch, between_tries: park}",
            ("AE102", "`between_tries` runs between two tries, so it needs `retry`"),
        ),
        ("{skill: use}", ("AE102", "`use` needs the input `gain`")),
    ],
)
def test_a_fault_of_a_part_is_reported(do: str, message: tuple[str, str]) -> None:
    assert _refused(f"do: {do}") == [message]


@pytest.mark.parametrize(
    ("do", "message"),
    [
        ("{skill: fech}", "`fech` is not a skill or capability of this module"),
        ("{skill: fetch, retry: 1, between_tries: prk}", "`prk` is not a skill or capability of this module"),
        ("{skill: use, inputs: {gain: 2 s}}", "expected"),
        ("{skill: use, inputs: {gain: 1 m, gin: 1 m}}", "`gin` is not an input of `use`"),
        (
            "{seq: [{skill: measure}, {skill: use, inputs: {gain: {from: measure.amont}}}]}",
            "`measure.amont` is not an output of a step",
        ),
        ("{skill: use, inputs: {gain: {from: nobody.amount}}}", "`nobody.amount` is not an output of a step"),
        ("{if: tidy, then: {skill: park}}", "tidy"),
    ],
)
def test_a_name_without_meaning_is_reported(do: str, message: str) -> None:
    assert message in _refused(f"do: {do}")[0][1]


def test_a_composition_is_not_named_like_a_skill() -> None:
    _, (message,) = _elaborated("do: {skill: park}", name="fetch")
    assert (message.code, message.headline) == ("AE121", "`fetch` is a skill already")


def test_a_handler_is_not_named_stop() -> None:
    ((code, headline),) = _refused("do: {skill: fetch}\nhandlers: {stop: {skill: park}}")
    assert (code, "cannot be named `stop`" in headline) == ("AE121", True)


def test_every_fault_of_a_composition_is_reported_and_it_is_left_out() -> None:
    message = _refused(
        "do:\n  seq:\n    - {skill: fetch, retry: 9}\n    - {skill: use}\n    - par: [{skill: park}]\n"
        "precondition: table_tdy\n"
    )
    assert [code for code, _ in message] == ["AE129", "AE102", "AE112", "AE202"]


def test_a_fault_of_a_whole_part_underlines_its_first_line() -> None:
    _, (message,) = _elaborated("do:\n  seq:\n    - skill: fetch\n      then: {skill: park}\n")
    assert message.primary is not None
    assert message.primary.span.text == "skill: fetch"
