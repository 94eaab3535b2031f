"""Names that skill code may use: what each list must not hold."""

from __future__ import annotations

import builtins
import collections.abc
import typing
from typing import Any

import pytest

from aeros.skill import Action
from aeros.spec.obligations.skill_syntax import allowed_names


def test_no_list_holds_a_dunder_name() -> None:
    lists = [allowed_names.ALLOWED_BUILTINS, allowed_names.ALLOWED_ATTRIBUTES]
    lists += allowed_names.ALLOWED_MEMBERS.values()
    assert not [name for one in lists for name in one if name.startswith("__")]


def test_bases_and_decorators_are_members_of_allowed_modules() -> None:
    for member in (
        *allowed_names.BASE_CLASSES,
        *allowed_names.CLASS_DECORATORS,
        *allowed_names.FUNCTION_DECORATORS,
    ):
        module, _, name = member.rpartition(".")
        assert name in allowed_names.ALLOWED_MEMBERS[module]


@pytest.mark.parametrize("name", sorted(allowed_names.GENERIC_TYPES))
def test_a_generic_type_of_actions_makes_no_action(name: str) -> None:
    for module in (builtins, collections.abc, typing):
        generic: Any = getattr(module, name, None)
        for inside in (Action, (Action, Action), (Action, Action, Action), ([Action], Action), (Action, ...)):
            made: object = None
            try:
                made = generic[inside]
                assert made is not Action
                made = made("drive", {})  # type: ignore[operator]
            except (TypeError, ValueError, NameError):
                continue
            assert not isinstance(made, Action)
