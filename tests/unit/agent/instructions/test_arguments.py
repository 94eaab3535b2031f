"""Words of a request give arguments to its task."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.instructions.arguments import (
    StatedValues,
    are_of_one_object,
    counted_parameter,
    is_object,
    value_phrases,
)
from aeros.agent.instructions.refusals import AmbiguousInstructionError, InstructionError
from aeros.agent.instructions.understand import understand
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, IntegerType
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import SPAN, module, task
from tests.unit.agent.instructions.lists.reference import reference_modules

THINGS = EnumType("objects", ("red_can", "green_can"))
SIDES = EnumType("m.side", ("left", "right"))


def parameter(name: str, type_: EnumType | IntegerType, default: object = None) -> TaskParameter:
    bounds = (Fraction(1), Fraction(3)) if isinstance(type_, IntegerType) else None
    declared = Declared(t.Variable(f"m.{name}", type_, t.VariableRole.STATE), SPAN, range=bounds)
    phrases: dict[str, dict[str, tuple[str, ...]]] = {
        "objects": {"red_can": ("red can", "can"), "green_can": ("green can", "can")},
        "m.side": {"left": ("left side",), "right": ("right side",)},
    }
    return TaskParameter(name, declared, default, phrases.get(getattr(type_, "name", ""), {}))


def fetch(**parameters: TaskParameter) -> Task:
    return replace(
        task("fetch", ("fetch",), "wrapper_aligned"), parameters=parameters, object_phrases=("thing",)
    )


THING, SIDE, TIMES = (
    parameter("thing", THINGS),
    parameter("side", SIDES, "left"),
    parameter("times", IntegerType(), Fraction(1)),
)
FETCH = fetch(thing=THING, side=SIDE, times=TIMES)


def asked(words: str, of: Task = FETCH) -> list[str]:
    modules: dict[str, Ecm] = {"m": module("m", (), of)}
    return [one.routed.formal_text for one in understand(words, modules).errands]


@pytest.mark.parametrize(
    ("words", "meaning"),
    [
        ("fetch the red can", "m.fetch(thing = red_can, side = left, times = 1)"),
        ("fetch the green cans", "m.fetch(thing = green_can, side = left, times = 1)"),
        ("fetch the red can, right side", "m.fetch(thing = red_can, side = right, times = 1)"),
        ("fetch right side green can can", "m.fetch(thing = green_can, side = right, times = 1)"),
    ],
)
def test_words_for_values_are_arguments_and_the_rest_are_defaults(words: str, meaning: str) -> None:
    of = fetch(thing=THING, side=SIDE, times=TIMES)
    if ", " in words:
        words = words.replace(", ", " ")
    assert asked(words, of) == [meaning]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("fetch the red can and green can left side right side", "`right side` contradicts another `side`"),
        ("fetch the red green can", "does not know `red`"),
        ("fetch the blue can", "does not know `blue`"),
    ],
)
def test_contradictions_and_unknown_values_are_refused(words: str, reason: str) -> None:
    with pytest.raises(InstructionError, match=reason):
        asked(words)


def test_a_word_for_several_values_is_a_question_with_an_instruction_for_each_answer() -> None:
    with pytest.raises(AmbiguousInstructionError, match=r"leaves open `thing`.*`red_can`.*`green_can`") as it:
        asked("fetch the can")
    assert it.value.candidates == {
        "red_can": "m.fetch side=left times=1 thing=red_can",
        "green_can": "m.fetch side=left times=1 thing=green_can",
    }
    assert asked(it.value.candidates["green_can"]) == ["m.fetch(thing = green_can, side = left, times = 1)"]
    with pytest.raises(AmbiguousInstructionError, match="leaves open `thing`"):
        asked("fetch the thing")


def test_a_number_before_an_object_is_the_only_whole_number_of_the_task() -> None:
    of = fetch(side=SIDE, times=TIMES)
    assert asked("fetch two things", of) == ["m.fetch(side = left, times = 2)"]
    with pytest.raises(InstructionError, match="`4` is out of range: `times` is 1 to 3"):
        asked("fetch 4 things", of)
    with pytest.raises(InstructionError, match="`three` is a second `times`"):
        asked("fetch two things three things", of)
    with pytest.raises(InstructionError, match="`two` is not understood"):
        asked("fetch two things", fetch(side=SIDE))
    assert counted_parameter(of) is TIMES
    assert counted_parameter(fetch(times=TIMES, more=TIMES)) is None


def test_only_an_object_of_the_site_is_what_a_task_acts_on() -> None:
    assert (is_object(THING), is_object(SIDE), is_object(TIMES)) == (True, False, False)
    names = {(one.words, one.names_object) for one in value_phrases(FETCH)}
    assert (("can",), True) in names
    assert (("left", "side"), False) in names
    stated = StatedValues(FETCH)
    assert list(stated.open_parameters()) == [("thing", ["red_can", "green_can"])]
    assert not stated.is_specific


REFERENCE = {
    "bring me the blue block": ["fetch_object.fetch_object(object = blue_block, to = anywhere)"],
    "fetch the object": ["fetch_object.fetch_object(object = red_can, to = anywhere)"],
    "put the blue box on the left side of the stand": [
        "fetch_object.fetch_object(object = blue_block, to = left)"
    ],
    "fetch the can and the block": [
        "fetch_object.fetch_object(object = red_can, to = anywhere)",
        "fetch_object.fetch_object(object = blue_block, to = anywhere)",
    ],
    "fetch the block, then put it on the right": [
        "fetch_object.fetch_object(object = blue_block, to = anywhere)",
        "fetch_object.fetch_object(object = blue_block, to = right)",
    ],
    "fetch_object object=blue_block": ["fetch_object.fetch_object(object = blue_block, to = anywhere)"],
}


@pytest.mark.parametrize("words", REFERENCE)
def test_objects_and_places_of_the_reference_modules(words: str) -> None:
    meaning = understand(words, reference_modules())
    assert [one.routed.formal_text for one in meaning.errands] == REFERENCE[words]


def test_a_prohibition_is_of_the_values_that_it_says_or_of_all() -> None:
    modules = reference_modules()
    meaning = understand("fetch the red can, but not the blue block", modules)
    assert meaning.formal_lines[1:] == ("never fetch_object.fetch_object(object = blue_block)",)
    for words in ("fetch the red can, but not the can", "fetch the red can. never fetch the object"):
        with pytest.raises(InstructionError, match="prohibits it"):
            understand(words, modules)


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("clean the table, then inspect it", ("clean_table.clean_table", "inspect_table.inspect_table")),
        ("inspect the table, then wipe it", ("inspect_table.inspect_table", "clean_table.clean_table")),
        ("the table is a mess, so inspect it", ("inspect_table.inspect_table",)),
    ],
)
def test_it_is_the_object_of_another_task_with_the_same_objects(text: str, meaning: tuple[str, ...]) -> None:
    assert tuple(str(one.routed) for one in understand(text, reference_modules()).errands) == meaning


@pytest.mark.parametrize(
    "text",
    [
        "clean the left half of the table, then inspect it",  # the half, which no words of the other task say
        "fetch the can, then inspect it",
    ],
)
def test_it_is_no_object_that_the_task_does_not_know(text: str) -> None:
    with pytest.raises(InstructionError, match="does not know `it`"):
        understand(text, reference_modules())


def test_tasks_are_of_one_object_if_they_have_the_same_words_for_it_and_no_parameter_chooses_it() -> None:
    tasks = {
        name: RoutedTask(name, reference_modules()[name].tasks[name])
        for name in ("clean_table", "inspect_table", "serve_table", "fetch_object")
    }
    assert are_of_one_object([tasks["clean_table"], tasks["inspect_table"]])
    assert are_of_one_object([tasks["clean_table"], tasks["serve_table"]])
    assert not are_of_one_object([tasks["fetch_object"], tasks["fetch_object"]])
