"""Skill code in memory: which values are actions and outputs."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.skills.contract import (
    MAX_PARAMETERS,
    NoActionError,
    check_outputs,
    copy_action,
)
from aeros.skill import Action

# Actions.


def test_an_action_is_copied_with_lists_as_tuples() -> None:
    target, parameters = [0.0, 1.0], {"speed": 0.5}
    yielded = Action("move", {"target": target, **parameters})
    copied = copy_action(yielded)
    assert copied == Action("move", {"target": (0.0, 1.0), "speed": 0.5})
    target.append(2.0)
    yielded.parameters["speed"] = 9.0  # type: ignore[index]
    assert copied == Action("move", {"target": (0.0, 1.0), "speed": 0.5})


class SlyAction(Action):
    """An action that could run code of the skill."""


class Sly(dict[str, Any]):
    """A mapping that could run code of the skill."""


class Name(str):
    """A name that could run code of the skill."""

    __slots__ = ()


@pytest.mark.parametrize(
    ("yielded", "why"),
    [
        (None, "the skill yielded a `NoneType`, not an action"),
        (("move", {}), "the skill yielded a `tuple`, not an action"),
        (SlyAction("move", {}), "the skill yielded a `SlyAction`, not an action"),
        (Action("move", None), "parameters that are not a dict of at most 64"),  # type: ignore[arg-type]
        (Action("move", Sly()), "parameters that are not a dict of at most 64"),
        (Action("move", {str(n): 0 for n in range(65)}), "parameters that are not a dict of at most 64"),
        (Action("move", {1: 0}), "a kind or a parameter name that is not a string"),  # type: ignore[dict-item]
        (Action("move", {Name("x"): 0}), "a kind or a parameter name that is not a string"),
        (Action(Name("move"), {}), "a kind or a parameter name that is not a string"),
        (Action(3, {}), "a kind or a parameter name that is not a string"),  # type: ignore[arg-type]
    ],
)
def test_a_value_that_is_no_action_is_refused_in_words(yielded: object, why: str) -> None:
    with pytest.raises(NoActionError, match=why):
        copy_action(yielded)


def test_as_many_parameters_as_allowed_are_copied() -> None:
    assert MAX_PARAMETERS == 64
    many = {str(n): n for n in range(64)}
    assert copy_action(Action("move", many)).parameters == many
    assert check_outputs(many) == many


# Outputs.


def test_outputs_are_copied_with_lists_as_tuples() -> None:
    assert check_outputs(None) is None
    assert check_outputs({}) == {}
    place = [1.0, 2.0]
    outputs = check_outputs({"at": place, "found": True, "deep": ([1],)})
    place.append(3.0)
    assert outputs == {"at": (1.0, 2.0), "found": True, "deep": ([1],)}


@pytest.mark.parametrize(
    ("returned", "why"),
    [
        (3, "the skill returned a `int`, not a dict of at most 64 outputs"),
        (Sly(), "the skill returned a `Sly`, not a dict"),
        ({str(n): n for n in range(65)}, "not a dict of at most 64 outputs"),
        ({1: 2}, "an output whose name is not a string"),
        ({Name("at"): 2}, "an output whose name is not a string"),
    ],
)
def test_a_value_that_is_no_set_of_outputs_is_refused_in_words(returned: object, why: str) -> None:
    with pytest.raises(NoActionError, match=why):
        check_outputs(returned)
