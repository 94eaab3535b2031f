"""Words for all of a kind are understood where a task is done for all, and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.instructions.lexicon import (
    plural_objects,
    singular_objects,
    task_phrases,
    universal_noun,
)
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import IntegerType
from aeros.spec.model.ecm import Task
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import SPAN, module, task
from tests.unit.agent.instructions.lists.reference import parametric_modules

SORT = replace(
    task("sort", ("sort", "put away"), "wrapper_aligned"),
    object_phrases=("bolts", "loose bolts"),
    extra_phrases=("into (two) (marked) trays", "by length", "of"),
)


def meaning(instruction: str, sort: Task = SORT) -> list[str]:
    modules = {**parametric_modules(), "shop": module("shop", (), sort)}
    return [str(one.routed) for one in understand(instruction, modules).errands]


@pytest.mark.parametrize(
    "instruction",
    [
        "sort the bolts",
        "sort all bolts",
        "sort all of my loose bolts by length",
        "sort every bolt",
        "sort every loose bolt into the two marked trays",
        "sort each of the bolts",
        "sort every one of the bolts",
        "sort every single bolt",
        "sort any bolts",
        "put all the bolts away",
        "all bolts should be sorted",
        "have each bolt sorted into trays",
    ],
)
def test_all_of_a_kind_is_what_a_noun_in_the_plural_asks_for(instruction: str) -> None:
    assert meaning(instruction) == ["shop.sort"]


@pytest.mark.parametrize(
    "instruction",
    [
        "sort a bolt",
        "sort the bolt",
        "sort one bolt",
        "sort any bolt",
        "sort some bolts",
        "sort some of the bolts",
        "sort one of the bolts",
        "sort any of the bolts",
        "sort the bolts, one of them",
        "sort the bolts, then sort one",
        "sort all of some bolts",
        "sort a few bolts",
        "sort several bolts",
        "sort two bolts",
        "sort both bolts",
        "sort most bolts",
        "sort half of the bolts",
        "sort the full bolts",
        "sort all long bolts",
        "sort almost all bolts",
        "sort every other bolt",
        "sort every second bolt",
        "sort all but two bolts",
        "sort all bolts but one",
        "sort all bolts except the long ones",
        "sort not all bolts",
        "sort not every bolt",
        "sort all nuts",
        "sort all",
        "sort each bolt twice",
        "sort all bolts or trays",
        "make all dumplings",
        "make every dumpling",
        "clean all tables",
        "clean each table",
        "fetch every can",
        "bring me any can",
    ],
)
def test_fewer_than_all_and_all_of_what_is_done_once_are_refused(instruction: str) -> None:
    with pytest.raises(InstructionError):
        meaning(instruction)


def test_a_number_of_things_is_no_all_of_them() -> None:
    variable = t.Variable("shop.bolts", IntegerType(), t.VariableRole.STATE)
    declared = Declared(variable, SPAN, range=(Fraction(1), Fraction(9)))
    counted = replace(SORT, parameters={"bolts": TaskParameter("bolts", declared, Fraction(3))})
    with pytest.raises(
        InstructionError, match="`all` is not understood: `bolts` says how many; say a number"
    ):
        meaning("sort all bolts", counted)
    assert meaning("sort three bolts", counted) == ["shop.sort"]


def test_articles_are_free_within_extras_and_bracketed_words_optional() -> None:
    for place in ("into trays", "into two trays", "into the two trays", "into a marked trays"):
        assert meaning(f"sort the bolts {place}") == ["shop.sort"]
    refused = "does not know `into`, `marked`, `boxes`; nearest to that is `into (two) (marked) trays`"
    with pytest.raises(InstructionError) as refusal:
        meaning("sort the bolts into marked boxes")
    assert refused in str(refusal.value)
    with pytest.raises(InstructionError):
        meaning("sort the bolts into three trays")


def test_a_prohibition_of_all_prohibits_the_task() -> None:
    modules = {**parametric_modules(), "shop": module("shop", (), SORT)}
    found = understand("clean the table, but do not sort all bolts", modules)
    assert [str(one) for one in found.prohibited] == ["shop.sort"]


def test_nouns_are_found_behind_the_words_for_all() -> None:
    (entry,) = task_phrases({"shop": module("shop", (), replace(SORT, object_phrases=("glass", "bolts")))})
    assert plural_objects(entry) == {("bolts",)}
    assert ("bolt",) in singular_objects(entry)
    assert universal_noun(entry, ("all", "my", "bolts"), 0) == range(2, 3)
    assert not universal_noun(entry, ("all", "glass"), 0)
    assert not universal_noun(entry, ("every", "one", "bolt"), 0)
