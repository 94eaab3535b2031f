"""Histories as a runtime keeps them, against the definition along the whole trace.

Where every moment is measured, a history is known and has the value that `semantics.evaluate` gives
it.  Where some are not, a history that is known all the same has that value whatever was missed:
every completion of the trace, with values for what was not measured and moments in the gaps, agrees.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.past_time import HistoryCollector as Flattened
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import TimedState, evaluate
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from tests.hypothesis_profiles import examples
from tests.unit.runtime.bench import configuration

SPAN = Source("site.yaml", "text").span(0, 4)
AGE = Fraction(2)
PAIR = EnumType("Pair", ("left", "right"))
_TYPES: Mapping[str, Type] = {"a": BOOL, "b": BOOL, "x": RealType(NUMBER), "f": FamilyType(PAIR, BOOL)}
STATE: Mapping[str, Declared] = {
    name: Declared(
        t.Variable(name, type_, t.VariableRole.STATE),
        SPAN,
        range=(Fraction(0), Fraction(3)) if name == "x" else None,
        max_age=AGE,
        sensor="eye",
    )
    for name, type_ in _TYPES.items()
}
A, B, X, F = (STATE[name].variable for name in "abxf")
INDEX = t.BoundVariable("side", PAIR)
_ONE = t.Literal(Fraction(1), RealType(NUMBER))
MEASURED = (A, B, t.Compare("<=", X, _ONE))
ATOMS = (*MEASURED, t.TRUE, t.FALSE)  # what holds of moments that nobody looks at, nobody counts
WINDOWS = st.sampled_from((None, Fraction(1), Fraction(2), Fraction(7, 2)))


@st.composite
def conditions(draw: Any, depth: int = 3, atoms: tuple[t.Term, ...] = ATOMS) -> t.Term:
    """A condition on state that looks back, with operators inside operators."""
    if depth == 0:
        return cast("t.Term", draw(st.sampled_from(atoms)))
    within = conditions(depth - 1, atoms)
    below = st.one_of(
        st.sampled_from(atoms),
        within,
        st.builds(t.Not, within),
        st.builds(lambda a, b: t.And((a, b)), within, within),
    )
    chosen = draw(
        st.one_of(
            st.builds(t.Previously, below),
            st.builds(t.Since, below, below, WINDOWS),
            st.builds(lambda c, w: t.Since(t.TRUE, c, w), below, WINDOWS),
            st.builds(
                lambda c, w, op: t.Compare(op, _ONE, t.Occurrences(c, w)),
                below,
                WINDOWS.filter(lambda one: one is not None),
                st.sampled_from(("<", "<=", "==")),
            ),
            st.builds(
                lambda kind, w: t.Quantified(kind, INDEX, t.Since(t.TRUE, t.Select(F, INDEX), w)),
                st.sampled_from(("all", "any")),
                WINDOWS,
            ),
        )
    )
    return cast("t.Term", chosen)


values = st.fixed_dictionaries(
    {
        "a": st.booleans(),
        "b": st.booleans(),
        "x": st.sampled_from((0.0, 1.0, 2.5)),
        "f": st.tuples(st.booleans(), st.booleans()),
    }
)
steps = st.sampled_from((0.0, 0.25, 0.5, 1.0, 2.0))
traces = st.lists(st.tuples(steps, values), min_size=1, max_size=7)


def kept(term: t.Term) -> tuple[t.Term, Site]:
    """The condition over histories, and a site that has them."""
    flattened = Flattened()
    flat = flattened.replace_past_terms(term, SPAN)
    return flat, replace(configuration().site, state=STATE, histories=flattened.collected)


def exact(given: Mapping[str, Any]) -> dict[str, Any]:
    return {name: Fraction(one) if type(one) is float else one for name, one in given.items()}


def timed(trace: Sequence[tuple[float, Mapping[str, Any]]]) -> list[tuple[float, Mapping[str, Any]]]:
    now, found = 0.0, []
    for step, seen in trace:
        now += step
        found.append((now, seen))
    return found


@examples(60)
@given(conditions(), traces)
def test_a_history_of_measurements_equals_the_definition(
    term: t.Term, trace: list[tuple[float, Mapping[str, Any]]]
) -> None:
    flat, site = kept(term)
    histories = HistoryTracker(site)
    states: list[TimedState] = []
    for now, seen in timed(trace):
        states.append(TimedState(Fraction(now), exact(seen)))
        known = histories.advance({name: Reading(one, now) for name, one in seen.items()}, now)
        assert known.keys() == histories.names
        env = {**states[-1].values, **exact(known)}
        env = {name: Fraction(one) if type(one) is int else one for name, one in env.items()}
        assert evaluate(flat, env) == evaluate(term, states[-1].values, states)


@examples(60)
@given(conditions(2, MEASURED), traces, st.randoms(use_true_random=False), st.booleans())
def test_a_known_history_stays_known_if_measurements_are_missed(
    term: t.Term, trace: list[tuple[float, Mapping[str, Any]]], chance: random.Random, slow: bool
) -> None:
    _, site = kept(term)
    histories = HistoryTracker(site)
    named = {one.declared.name: one.term for one in site.histories}
    looks = [
        (2.0 * now if slow else now, {name: one for name, one in seen.items() if chance.random() < 0.8})
        for now, seen in timed(trace)
    ]
    missed = 3.0  # how long a gap has to be for something to happen in it: longer than a reading speaks
    completions: list[list[TimedState]] = [[] for _ in range(4)]
    last = None
    for now, seen in looks:
        known = histories.advance({name: Reading(one, now) for name, one in seen.items()}, now)
        for states in completions:
            if last is not None and now - last > missed:
                states.append(TimedState(Fraction(now + last) / 2 + AGE / 2, _completed({}, chance)))
            states.append(TimedState(Fraction(now), _completed(seen, chance)))
            env = dict(states[-1].values)
            for name, past in named.items():
                value = evaluate(past, env, [*states[:-1], TimedState(states[-1].time, env)])
                # Earlier moments need the histories that they were judged by.
                env[name] = value
                if name in known:
                    assert known[name] == value, (name, looks)
            states[-1] = TimedState(states[-1].time, env)
            for index, before in enumerate(states[:-1]):
                if not named.keys() <= before.values.keys():
                    states[index] = _judged(named, states, index)
        last = now


def _judged(named: Mapping[str, t.Term], states: list[TimedState], index: int) -> TimedState:
    env = dict(states[index].values)
    for name, past in named.items():
        env[name] = evaluate(past, env, [*states[:index], TimedState(states[index].time, env)])
    return TimedState(states[index].time, env)


def _completed(given: Mapping[str, Any], chance: random.Random) -> dict[str, Any]:
    anything = {
        "a": chance.random() < 0.5,
        "b": chance.random() < 0.5,
        "x": chance.choice((0.0, 1.0, 2.5)),
        "f": (chance.random() < 0.5, chance.random() < 0.5),
    }
    return exact({**anything, **given})


def test_most_histories_of_a_broken_trace_are_unknown_for_a_while_and_then_known() -> None:
    """The test above proves something: there are unknown histories, and known ones after gaps."""
    once = t.Since(t.TRUE, A, Fraction(3))
    _, site = kept(once)
    (name,) = (one.declared.name for one in site.histories)
    histories = HistoryTracker(site)

    def at(now: float, **given: Any) -> Any:
        known = histories.advance({key: Reading(one, now) for key, one in given.items()}, now)
        return known.get(name)

    assert at(0.0, a=False) is False
    assert at(1.0) is None  # nobody looked
    assert at(2.0, a=False) is None
    assert at(4.0, a=False) is None
    assert at(5.0, a=False) is None
    assert at(5.5, a=False) is False  # what nobody saw is more than 3 s ago
    assert at(8.0, a=False) is None  # a reading speaks for 2 s, and 2.5 s have passed
    assert at(8.5, a=True) is True  # known again: it holds now
    assert at(10.5, a=False) is True
    assert at(12.0, a=False) is False


@pytest.mark.parametrize("later", [float("nan"), float("inf"), -1.0, True, None])
def test_a_clock_that_stops_goes_back_or_has_no_time_leaves_nothing_known(later: Any) -> None:
    _, site = kept(t.Since(t.TRUE, A, Fraction(3)))
    histories = HistoryTracker(site)
    readings = {"a": Reading(False, 0.0)}
    assert histories.advance(readings, 0.0).keys() == histories.names
    assert histories.advance(readings, later) == {}
    assert histories.advance({"a": Reading(False, 1.0)}, 1.0) == {}
    assert histories.advance({"a": Reading(False, 2.0)}, 2.0) == {}


class _Float(float):
    pass


_VALUES: tuple[Any, ...] = (float("nan"), float("inf"), True, "1", None, _Float(1), 10**400, (1.0,))
_TIMES: tuple[Any, ...] = (float("nan"), True, None, _Float(5), -(10**30), 5.000000000000001)
FAULTY: tuple[Any, ...] = (
    None,
    1.0,
    (1.0, 5.0),
    tuple.__new__(Reading),  # without its fields
    *(Reading(value, 5.0) for value in (*_VALUES, -5e-324, 3.0000000000000004)),
    *(Reading(1.0, time) for time in (*_TIMES, 2.9999999999999996)),
)


@pytest.mark.parametrize("faulty", FAULTY, ids=map(str, range(len(FAULTY))))
def test_a_reading_that_does_not_serve_leaves_unknown_what_reads_it_and_nothing_else(faulty: Any) -> None:
    near = t.Since(t.TRUE, t.Compare("<=", X, _ONE), Fraction(3))
    _, site = kept(t.And((near, t.Since(t.TRUE, A, None))))
    of_x, of_a = (one.declared.name for one in site.histories)

    def known(reading: Any) -> set[str]:
        histories = HistoryTracker(site)
        readings = {"x": Reading(2.0, 4.0), "a": Reading(True, 4.0)}
        assert histories.advance(readings, 4.0) == {of_x: False, of_a: True}
        return set(histories.advance({"a": Reading(True, 5.0), "x": reading}, 5.0))

    assert known(faulty) == {of_a}
    for serves in (Reading(1.0, 5.0), Reading(1, 5), Reading(3.0, 3.0), Reading(-0.0, 5.0)):
        assert known(serves) == {of_x, of_a}


def test_memory_is_bounded_for_all_counts() -> None:
    flat, site = kept(t.Compare("<=", _ONE, t.Occurrences(A, Fraction(1_000_000))))
    assert isinstance(flat, t.Compare)
    (history,) = site.histories
    most = int((history.declared.range or (0, 0))[1])
    histories = HistoryTracker(site)
    for tick in range(most):
        known = histories.advance({"a": Reading(True, float(tick))}, float(tick))
    assert known[history.declared.name] == most
    assert histories.advance({"a": Reading(True, float(most))}, float(most)) == {}


def test_unknown_values_stay_unknown_also_when_more_happens_than_is_kept() -> None:
    _, site = kept(t.Compare("<=", _ONE, t.Occurrences(A, Fraction(10))))
    (history,) = site.histories
    few = replace(history, declared=replace(history.declared, range=(Fraction(0), Fraction(2))))
    histories = HistoryTracker(replace(site, histories=(few,)))

    def at(now: float, **given: Any) -> Any:
        known = histories.advance({key: Reading(one, now) for key, one in given.items()}, now)
        return known.get(few.declared.name)

    assert at(0.0, a=True) == 1
    assert at(1.0, a=True) == 2
    assert at(2.0) is None
    assert at(3.0, a=True) is None  # until now there may have been others, which count until 13 s
    assert at(4.0, a=True) is None
    for now in range(5, 14):
        assert at(float(now), a=False) is None
    assert at(13.5, a=False) == 1
