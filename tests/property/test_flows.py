"""Claims about data, handlers and actuators of compositions, against runs that are spelt out one by one."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, RealType, Type
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.composition import Composition, OutputReference, Part, Step
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
    TimedPart,
    steps_of,
    walk_parts,
)
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.data_flow import data_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from tests.property.mix import Mix
from tests.property.test_compositions import TEXT, P, _module, _site, _skill, bounded

SPAN = TEXT.span(0, 1)


@st.composite
def _bodies(draw: st.DrawFn) -> Part:
    numbers = itertools.count(1)

    def part(depth: int) -> Part:
        forms = ["step", "seq", "seq", "par", "if", "any", "again", "within"]
        form = draw(st.sampled_from(forms)) if depth else "step"
        at = next(numbers)
        span = TEXT.span(at, at + 1)
        if form == "step":
            return Step(f"step{at}", "s0", {}, {}, 0, None, "stop", span)
        if form == "if":
            otherwise = draw(st.sampled_from([part(depth - 1), Seq(()), None]))
            return If(P, "p", part(depth - 1), otherwise, span)
        if form == "again":
            return RetriedPart(part(depth - 1), 1, span)
        if form == "within":
            return TimedPart(part(depth - 1), span, True, Fraction(1))
        if form == "any":
            return Fallback((part(depth - 1), draw(st.sampled_from([part(depth - 1), Seq(())]))), span)
        inner = tuple(part(depth - 1) for _ in range(2))
        return Seq(inner) if form == "seq" else Par(inner, span)

    return part(3)


def _with(part: Part, flows: dict[str, OutputReference]) -> Part:
    """`part` in which the step `name` takes `flows[name]`."""
    match part:
        case Step(id=name):
            return replace(part, output_references={"given": flows[name]} if name in flows else {})
        case Seq(parts=inner):
            return replace(part, parts=tuple(_with(one, flows) for one in inner))
        case Par(branches=inner):
            return replace(part, branches=tuple(_with(one, flows) for one in inner))
        case If(then=then, otherwise=otherwise):
            other = None if otherwise is None else _with(otherwise, flows)
            return replace(part, then=_with(then, flows), otherwise=other)
        case Fallback(parts=inner):
            return replace(part, parts=tuple(_with(one, flows) for one in inner))
        case RetriedPart(part=one) | TimedPart(part=one):
            return replace(part, part=_with(one, flows))
        case FailingPart() | StoppablePart():
            return part


def _runs(part: Part) -> Iterator[tuple[str, ...]]:
    """Every order in which the steps of `part` can succeed, whatever is measured."""
    match part:
        case Step(id=name):
            yield (name,)
        case Seq(parts=inner):
            for each in itertools.product(*(list(_runs(one)) for one in inner)):
                yield tuple(itertools.chain(*each))
        case Par(branches=(first, second)):
            for one, other in itertools.product(_runs(first), _runs(second)):
                yield from _merged(one, other)
        case If(then=then, otherwise=otherwise):
            yield from _runs(then)
            yield from () if otherwise is None else _runs(otherwise)
        case Fallback(parts=inner):
            for way in inner:
                yield from _runs(way)
        case RetriedPart(part=again) | TimedPart(part=again):
            yield from _runs(again)


def _merged(one: tuple[str, ...], other: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    if not one or not other:
        yield one + other
        return
    yield from ((one[0], *rest) for rest in _merged(one[1:], other))
    yield from ((other[0], *rest) for rest in _merged(one, other[1:]))


_NUMBERS = [Fraction(number) for number in range(4)]
_RANGES = st.tuples(st.sampled_from(_NUMBERS), st.sampled_from(_NUMBERS)).map(lambda r: (min(r), max(r)))
_TYPES: st.SearchStrategy[Type] = st.sampled_from(
    [RealType(NUMBER), RealType(NUMBER), RealType(LENGTH), BOOL]
)


@st.composite
def _declared(draw: st.DrawFn) -> Declared:
    type_ = draw(_TYPES)
    return Declared(
        t.Variable("d", type_, t.VariableRole.INPUT), SPAN, range=None if type_ == BOOL else draw(_RANGES)
    )


def _admitted(one: Declared) -> set[tuple[Type, Any]]:
    """Its values at every bound there is and between them, where two ranges that differ do so."""
    if one.range is None:
        return {(one.variable.type, value) for value in (False, True)}
    points = [Fraction(half, 2) for half in range(7)]
    return {(one.variable.type, value) for value in points if one.range[0] <= value <= one.range[1]}


def _settled(body: Part, skills: dict[str, Skill], handlers: dict[str, Step]) -> dict[str, StaticClaim]:
    composition = Composition("c", t.TRUE, None, body, handlers, SPAN)
    claims = composition_obligations(_module(skills, composition), _site())
    return {str(one.id).removeprefix("composition/c/"): one for one in claims if isinstance(one, StaticClaim)}


FLOWS, FAILURES, HANDLERS, ARMS = Mix(), Mix(), Mix(), Mix()


def test_data_is_refused_exactly_where_some_run_lacks_it_or_some_value_does_not_fit() -> None:
    _flows_are_judged()
    FLOWS.assert_both("AE852", "AE853")


@bounded
@given(_bodies(), st.data(), _declared(), _declared())
def _flows_are_judged(body: Part, data: st.DataObject, output: Declared, wanted: Declared) -> None:
    names = [step.id for step in steps_of(body)]
    sources = st.sampled_from(names)
    flows = {name: OutputReference(data.draw(sources), "out", SPAN) for name in names}
    flows = {name: flow for name, flow in flows.items() if flow.step != name}
    done = Outcome("done", {}, False, None, None)
    skill = _skill("s0", None, [done], outputs={"out": output}, inputs={"given": wanted})
    composition = Composition("c", t.TRUE, None, _with(body, flows), {}, SPAN)
    found = {
        str(one.id).removeprefix("composition/c/"): one
        for one in data_obligations(composition, {"s0": skill})
    }
    runs = [run for run, _ in zip(_runs(body), range(5_000), strict=False)]
    assert len(runs) < 5_000
    for name, flow in flows.items():
        reached = [run[: run.index(name)] for run in runs if name in run]
        there = found[f"{name}/given/there"]
        assert reached
        FLOWS.compare(
            "AE853", proved=there.diagnostic is None, expected=all(flow.step in run for run in reached)
        )
        fits = found[f"{name}/given/fits"]
        FLOWS.compare(
            "AE852", proved=fits.diagnostic is None, expected=_admitted(output) <= _admitted(wanted)
        )


_OUTCOMES = st.lists(
    st.tuples(st.booleans(), st.sampled_from([None, Fraction(0), Fraction(1, 2)])), max_size=2
)


def test_an_unhandled_failure_is_refused_exactly_where_it_can_occur() -> None:
    _failures_are_judged()
    FAILURES.assert_both("AE854")


@bounded
@given(_OUTCOMES, st.integers(0, 1), st.sampled_from([None, "stop", "h0"]), st.booleans(), st.booleans())
def _failures_are_judged(
    outcomes: list[tuple[bool, Fraction | None]], retry: int, last: str | None, stops: bool, tolerated: bool
) -> None:
    ends = [Outcome(f"o{n}", {}, failure, chance, None) for n, (failure, chance) in enumerate(outcomes)]
    skill = _skill("s0", None, [Outcome("done", {}, False, None, None), *ends])
    step = Step("step", "s0", {}, {}, retry, None, last, SPAN)
    handler = Step("h0", "s0", {}, {}, 0, None, "stop", TEXT.span(1, 2))
    part: Part = TimedPart(step, SPAN, stops, Fraction(1))
    part = Fallback((part, Seq(())), SPAN) if tolerated else part
    found = _settled(part, {"s0": skill}, {"h0": handler})
    silent = retry == 0 and last is None and not tolerated
    unsaid = [one for one in ends if silent and one.failure and one.probability != 0]
    FAILURES.compare("AE854", proved=found["step/handled"].diagnostic is None, expected=not unsaid)
    handled = found["part-1/handled"].diagnostic is None
    FAILURES.compare("AE854", proved=handled, expected=stops or tolerated)


def test_handlers_are_refused_exactly_where_failures_could_go_on_for_ever() -> None:
    _handlers_are_judged()
    HANDLERS.assert_both("AE856")


@bounded
@given(st.lists(st.sampled_from([None, "stop", "h0", "h1", "h2"]), min_size=3, max_size=3))
def _handlers_are_judged(lead: list[str | None]) -> None:
    handlers = {
        f"h{n}": Step(f"h{n}", "s0", {}, {}, 1, None, to, TEXT.span(n + 1, n + 2))
        for n, to in enumerate(lead)
    }
    skill = _skill("s0", None, [Outcome("done", {}, False, None, None)])
    found = _settled(Step("step", "s0", {}, {}, 0, None, None, SPAN), {"s0": skill}, handlers)["handlers"]

    def ends(name: str | None) -> bool:
        for _ in range(4):  # one failure more than there are handlers
            name = None if name in (None, "stop") else lead[int(name[1:])]
        return name is None

    HANDLERS.compare("AE856", proved=found.diagnostic is None, expected=all(map(ends, handlers)))


def test_an_actuator_is_refused_exactly_where_two_runs_at_once_move_it() -> None:
    _actuators_are_judged()
    ARMS.assert_both("AE859")


@bounded
@given(
    _bodies().filter(lambda body: any(isinstance(part, Par) for part in walk_parts(body))),
    st.lists(st.frozensets(st.sampled_from("lrx"), max_size=2), min_size=3, max_size=3),
    st.data(),
)
def _actuators_are_judged(body: Part, moved: list[frozenset[str]], data: st.DataObject) -> None:
    skills = {
        f"s{n}": _skill(f"s{n}", None, [Outcome("done", {}, False, None, None)], actuators=some)
        for n, some in enumerate(moved)
    }
    names = st.sampled_from(["s0", "s1"])
    handled = st.sampled_from([None, None, "h0"])

    def filled(part: Part) -> Part:
        match part:
            case Step():
                between, last = data.draw(handled), data.draw(handled)
                return replace(part, skill=data.draw(names), retry=1, between_tries=between, on_failure=last)
            case Seq(parts=inner):
                return replace(part, parts=tuple(map(filled, inner)))
            case Par(branches=inner):
                return replace(part, branches=tuple(map(filled, inner)))
            case If(then=then, otherwise=other):
                return replace(part, then=filled(then), otherwise=None if other is None else filled(other))
            case Fallback(parts=inner):
                return replace(part, parts=tuple(map(filled, inner)))
            case RetriedPart(part=one) | TimedPart(part=one):
                return replace(part, part=filled(one))
            case FailingPart() | StoppablePart():
                return part

    body = filled(body)
    handler = Step("h0", "s2", {}, {}, 0, None, "stop", TEXT.span(900, 901))
    found = _settled(body, skills, {"h0": handler})

    def movers(branch: Part) -> Iterator[frozenset[str]]:
        for step in steps_of(branch):
            yield skills[step.skill].actuators
            if "h0" in step.handlers:
                yield skills["s2"].actuators

    clashes = [
        bool(a & b)
        for par in (part for part in walk_parts(body) if isinstance(part, Par))
        for first, second in itertools.combinations(par.branches, 2)
        for a, b in itertools.product(movers(first), movers(second))
    ]
    refuted = any(one.diagnostic is not None for id_, one in found.items() if id_.endswith("/actuators"))
    ARMS.compare("AE859", proved=not refuted, expected=not any(clashes))
