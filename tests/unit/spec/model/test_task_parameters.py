"""Parameters of tasks, and the variables whose values depend on them."""

from __future__ import annotations

from aeros.spec.model.task_parameters import (
    ObjectKind,
    instruction_of,
    is_parameter,
    parameters_behind_variables,
)
from tests.unit.agent.instructions.lists.reference import reference_modules


def test_variables_depend_on_the_parameters_that_are_read_for_them_at_any_depth() -> None:
    behind = parameters_behind_variables(reference_modules().values())
    both = frozenset({"fetch_object.object", "fetch_object.to"})
    assert behind["fetch_object.object"] == frozenset({"fetch_object.object"})
    assert behind["fetch_object.object_position"] == both
    # `track` reads what `find_object` provides.
    assert behind["fetch_object.station_position"] == both
    assert "fetch_object.station_survey" not in behind
    # What is seen decides if enough is left for the count that is asked for.
    assert behind["make_dumplings.wrappers_suffice"] == frozenset({"make_dumplings.count"})
    assert "make_dumplings.press_position" not in behind


def test_without_parameters_nothing_depends_on_any() -> None:
    assert parameters_behind_variables([reference_modules()["inspect_table"]]) == {}


def test_a_parameter_is_known_by_what_sets_it() -> None:
    state = reference_modules()["fetch_object"].state
    assert {name for name, one in state.items() if is_parameter(one)} == {
        "fetch_object.object",
        "fetch_object.to",
    }
    assert state["fetch_object.to"].sensor == instruction_of("fetch_object")


def test_a_parameter_of_an_enum_lists_its_values() -> None:
    parameters = reference_modules()["fetch_object"].task_parameters
    assert parameters["fetch_object.to"].values == ("anywhere", "middle", "left", "right")
    assert parameters["fetch_object.to"].full_name == "fetch_object.to"
    task = reference_modules()["fetch_object"].tasks["fetch_object"]
    assert task.complete_arguments({"to": "left"}) == {"object": "red_can", "to": "left"}
    assert task.initial["fetch_object.object"] == "red_can"


def test_perceivers_get_shape_size_and_colour_as_plain_values() -> None:
    cup = ObjectKind(("cup",), "cylinder", (0.03, 0.08), (0.1, 0.2, 0.3))
    assert cup.for_perceivers() == {"shape": "cylinder", "size": (0.03, 0.08), "colour": (0.1, 0.2, 0.3)}
    assert ObjectKind(("cup",)).for_perceivers() == {"shape": "", "size": (), "colour": None}
