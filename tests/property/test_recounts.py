"""A true count is never objected to, whatever control ticks saw of which there is no record."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st

from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import Reading, Readings
from aeros.runtime.records.recount import SessionState
from aeros.spec.expr import terms as t
from tests.differential.gate.test_past_time import B, conditions, kept, steps, values
from tests.hypothesis_profiles import examples

Seen = Mapping[str, Any]
WITHOUT_B = {"a": False, "b": False, "x": 0.0, "f": (False, False)}
WITH_B = {**WITHOUT_B, "b": True}
looks = st.lists(st.tuples(steps, values), max_size=3)
decisions = st.lists(st.tuples(steps, values, st.booleans(), looks), min_size=1, max_size=6)


@examples(80)
@example(
    t.Since(t.TRUE, t.Not(t.Previously(B)), Fraction(1)),
    [(0.0, WITHOUT_B, True, [(0.0, WITH_B), (1.0, WITH_B)]), (0.25, WITHOUT_B, False, [])],
    SimpleNamespace(random=lambda: 0.0),
)
@given(conditions(), decisions, st.randoms(use_true_random=False))
def test_histories_as_they_were_kept_are_not_objected_to(
    term: t.Term, made: list[tuple[float, Seen, bool, list[tuple[float, Seen]]]], chance: Any
) -> None:
    _, site = kept(term)
    histories, recount, now = HistoryTracker(site), SessionState(site), 0.0

    def look(seen: Seen) -> Readings:
        readings = {name: Reading(one, now) for name, one in seen.items() if chance.random() < 0.8}
        return histories.update(readings, now)

    for step, seen, begins, ticks in made:
        now += step
        assert recount.history_mismatch(look(seen), now) is None
        if begins:
            recount.count_execution("move", now)
            for later, other in ticks:
                now += later
                look(other)
