"""Names that skill code may use: what each list must not hold."""

from __future__ import annotations

from aeros.spec.obligations import allowed_names


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
