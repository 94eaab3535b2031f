"""Laws of routing: an instruction goes to the one task that declares it, and to none where there is not one.

What is compared with is written apart: words joined by blanks, and a phrase that stands between two of those.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter

from hypothesis import assume, given
from hypothesis import strategies as st

from aeros.agent.planning.routing import RoutingError, route
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.model.ecm import Ecm
from tests.hypothesis_profiles import examples
from tests.unit.agent.dumplings import module, task

_VOCABULARY = ("clean", "table", "the", "wipe", "éclair", "रोटी", "straße", "2", "x_y")
_PHRASES = st.lists(st.sampled_from(_VOCABULARY), min_size=1, max_size=3).map(" ".join)
_TASKS = st.lists(st.lists(_PHRASES, min_size=1, max_size=3), max_size=4)
_INSTRUCTIONS = st.lists(st.sampled_from(_VOCABULARY), max_size=6).map(" ".join)
_COUNTED: Counter[int] = Counter()


def modules_of(tasks: list[list[str]]) -> dict[str, Ecm]:
    return {
        f"m{n}": module(f"m{n}", (), task("t", tuple(words), "wrapper_aligned"))
        for n, words in enumerate(tasks)
    }


def named_tasks(instruction: str, tasks: list[list[str]]) -> set[str]:
    text = f" {instruction} "
    return {f"m{n}.t" for n, words in enumerate(tasks) if any(f" {word} " in text for word in words)}


def answer(instruction: str, modules: dict[str, Ecm]) -> str | RoutingError:
    try:
        return str(route(instruction, modules))
    except RoutingError as refusal:
        return refusal


def test_an_instruction_is_routed_exactly_if_it_names_one_task_and_else_refused_with_a_reason() -> None:
    _routed_where_one_is_named()
    assert min(_COUNTED[n] for n in (0, 1, 2)) > 10, "nearly all instructions were of one kind"


@examples(100)
@given(_INSTRUCTIONS, _TASKS)
def _routed_where_one_is_named(instruction: str, tasks: list[list[str]]) -> None:
    expected, modules = named_tasks(instruction, tasks), modules_of(tasks)
    found = answer(instruction, modules)
    _COUNTED[min(len(expected), 2)] += 1
    if len(expected) == 1:
        assert {found} == expected
        return
    assert isinstance(found, RoutingError)
    reason = found.reason
    if expected:
        assert "may mean several tasks" in reason
        assert set(re.findall(r"`(m\d\.t)` \(", reason)) == expected
    else:
        assert reason.startswith("no installed module provides")
        nearest = re.findall(r"`([^`]*)` \((m\d+\.t)\)", reason.partition("nearest: ")[2])
        assert bool(nearest) == bool(tasks)
        assert all(word in set(tasks[int(name[1:-2])]) for word, name in nearest)


@examples(60)
@given(
    st.lists(st.sampled_from(_VOCABULARY), min_size=1, max_size=6),
    _TASKS,
    st.sampled_from([str.upper, str.title, str.swapcase, lambda text: unicodedata.normalize("NFD", text)]),
    st.sampled_from([", ", "  ", "\n", "! ", " – "]),
)
def test_neither_case_nor_punctuation_nor_composition_matters(
    words: list[str], tasks: list[list[str]], change_case: object, between: str
) -> None:
    assert callable(change_case)
    plain, modules = " ".join(words), modules_of(tasks)
    assume("straße" not in words or change_case is not str.swapcase)
    spoken = change_case(between.join(words))
    one, other = answer(plain, modules), answer(spoken, modules)
    assert isinstance(one, str) == isinstance(other, str)
    if isinstance(one, str):
        assert one == other


@examples(80)
@given(st.text(max_size=60), _TASKS)
def test_any_instruction_is_routed_or_refused_with_a_reason(instruction: str, tasks: list[list[str]]) -> None:
    found = answer(instruction, modules_of(tasks))
    assert isinstance(found, str) or 0 < len(found.reason) < 1000


@given(st.text(max_size=40))
def test_words_are_words_of_themselves_and_hold_no_blank(text: str) -> None:
    for word in normalized_words(text):
        assert normalized_words(word) == (word,)


def test_a_mark_belongs_to_its_letter() -> None:
    assert normalized_words("cafe\u0301") == normalized_words("Caf\u00e9") == ("café",)
    assert normalized_words("cafe\u0301") != normalized_words("cafe")
    assert normalized_words("रोटी") != normalized_words("रोटा")
    assert len(normalized_words("रोटी")) == 1
