"""Sets as terms: true exactly in the states of the set, quantities by their cells."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.closed_loop.symbolic import set_terms, state_sets
from aeros.spec.closed_loop.symbolic.set_terms import SetTerms
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.types import BOOL
from tests.differential.planning.number_loops import term
from tests.unit.agent.dumplings import rule
from tests.unit.spec.closed_loop.symbolic.certificates import type_of
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import loop

CONDITIONS = [
    "fill_level > 0.5",
    "fill_level <= 0.25 or dumpling_cooked",
    "not (0.25 < fill_level and fill_level < 0.5)",
    "dumpling_cooked and area == pot",
    "fill_level > 0 and fill_level < 0.25",
]
LEVELS = [Fraction(number, 16) for number in range(17)]


def is_in(made: SetTerms, condition: t.Term, env: dict[str, Value]) -> bool:
    """Evaluate a condition over defined truth values, whose definitions come before their use."""
    whole = dict(env)
    assert all(type_of(one) == BOOL for one in (condition, *made.definitions))
    for one, definition in zip(made.defined, made.definitions, strict=True):
        whole[one.name] = is_true(definition, {**whole, one.name: True})
    return is_true(condition, whole)


@pytest.mark.parametrize("clauses", [400, 0], ids=["clauses", "nodes"])
@pytest.mark.parametrize("ordered", [64, 0], ids=["thresholds", "digits"])
@pytest.mark.parametrize("text", CONDITIONS)
def test_a_set_as_a_term_holds_for_real_numbers_as_its_condition_does(
    text: str, ordered: int, clauses: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(state_sets, "MAX_ORDERED", ordered)
    monkeypatch.setattr(state_sets, "MAX_CLAUSES", clauses)
    for rules in ([rule(one, "wrap") for one in CONDITIONS], [rule(text, "wrap")]):
        made = loop(*rules, goal="dumpling_cooked")
        sets, program = made.fixpoints.sets, made.program
        terms = SetTerms(sets, program, program.variables)
        condition = terms.condition(sets.where(term(text)) & sets.valid)
        for level in LEVELS:
            for cooked in (False, True):
                for area in ("table", "pot"):
                    env: dict[str, Value] = {"fill_level": level, "dumpling_cooked": cooked, "area": area}
                    env |= dict.fromkeys(program.plan_bits, False) | {"dumpling_wrapped": False}
                    assert is_in(terms, condition, env) is is_true(term(text), env)


def test_clauses_that_are_given_and_unchanged_are_left_out() -> None:
    made = loop()
    sets, program = made.fixpoints.sets, made.program
    both, one = (
        sets.where(term(text)) for text in ("dumpling_cooked and dumpling_wrapped", "dumpling_cooked")
    )
    terms = SetTerms(sets, program, program.variables)
    assert terms.condition(both, one, ()) == term("dumpling_wrapped")
    assert terms.condition(one, both, ()) == t.TRUE
    assert terms.condition(one, both, ("dumpling_cooked",)) == term("dumpling_cooked")


@pytest.mark.parametrize("mark", ["", " after 1"])
def test_definitions_are_counted_and_named_apart(mark: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state_sets, "MAX_ORDERED", 0)
    monkeypatch.setattr(state_sets, "MAX_CLAUSES", 0)
    made = loop(rule("fill_level > 0.25 and fill_level < 0.5 or dumpling_wrapped", "wrap"))
    sets, program = made.fixpoints.sets, made.program
    terms = SetTerms(sets, program, program.variables, mark)
    wanted = sets.where(term("fill_level < 0.5 and not dumpling_wrapped")) & sets.valid
    first, again = terms.condition(wanted), terms.condition(wanted)
    assert first == again
    kinds = {one.name.partition(" ")[0] for one in terms.defined}
    assert kinds == {"set", "bit"}
    numbers = [one.name.removesuffix(mark).partition(" ")[2] for one in terms.defined]
    assert sorted(map(int, numbers)) == list(range(len(numbers)))
    assert all(one.name.endswith(mark) for one in terms.defined)
    assert {(one.type, one.role) for one in terms.defined} == {(BOOL, t.VariableRole.STATE)}
    assert terms.size == set_terms.DEFINITION_SIZE * len(terms.definitions) > 0
    assert terms.condition(sets.every) == t.TRUE
    assert terms.condition(sets.none) == t.FALSE


def test_clauses_are_counted() -> None:
    made = loop()
    sets, program = made.fixpoints.sets, made.program
    terms = SetTerms(sets, program, program.variables)
    terms.condition(sets.where(term("dumpling_cooked and not dumpling_wrapped")))
    assert terms.size == 2
    terms.condition(sets.where(term("dumpling_cooked or dumpling_wrapped")))
    assert terms.size == 3
