from __future__ import annotations

import pytest

from aeros.agent.planning.routing import RoutingError, route
from aeros.spec.model.ecm import Ecm
from tests.unit.agent.dumplings import CLEAN, DUMPLING, module, task

MODULES = {"dumpling": DUMPLING, "clean": CLEAN}


@pytest.mark.parametrize(
    ("instruction", "routed"),
    [
        ("make dumplings", "dumpling.make_dumplings"),
        ("One DUMPLING, please!", "dumpling.make_dumplings"),
        ("dumpling", "dumpling.make_dumplings"),
        ("Clean up.", "clean.clean_table"),
        ("please wipe  the\ntable now", "clean.clean_table"),
        ("make_dumplings", "dumpling.make_dumplings"),
        ("clean.clean_table", "clean.clean_table"),
    ],
)
def test_a_declared_word_routes_to_its_task(instruction: str, routed: str) -> None:
    assert str(route(instruction, MODULES)) == routed


@pytest.mark.parametrize(
    ("instruction", "message"),
    [
        (
            "make dumplingss",
            "no installed module provides `make dumplingss`; nearest: `dumplings` (dumpling.",
        ),
        ("unclean thoughts", "nearest: `clean` (clean.clean_table)"),
        ("the table", "no installed module provides `the table`; nearest: "),
        ("wipe a table", "no installed module provides"),
        ("", "no installed module provides ``; nearest: `clean` (clean.clean_table), `dumpling` (dumpling."),
        ("x" * 5000, "no installed module provides `xxx"),
    ],
)
def test_an_unknown_instruction_is_reported_with_the_nearest_known_one(
    instruction: str, message: str
) -> None:
    with pytest.raises(RoutingError) as refused:
        route(instruction, MODULES)
    assert message in str(refused.value)
    assert len(str(refused.value)) < 400


def test_ambiguity_is_reported_with_every_candidate() -> None:
    with pytest.raises(RoutingError) as refused:
        route("clean the dumpling", MODULES)
    assert str(refused.value) == (
        "`clean the dumpling` may mean several tasks: `dumpling.make_dumplings` (dumpling, dumplings),"
        " `clean.clean_table` (clean, wipe the table)"
    )


def test_two_tasks_of_one_word_are_ambiguous_even_in_one_module() -> None:
    twice = module("m", (), task("a", ("go",), "wrapper_aligned"), task("b", ("go",), "wrapper_aligned"))
    with pytest.raises(RoutingError, match=r"`m\.a` .*`m\.b`"):
        route("go", {"m": twice})


def test_without_modules_nothing_is_provided() -> None:
    with pytest.raises(RoutingError, match="no task is installed"):
        route("make dumplings", {})
    with pytest.raises(RoutingError, match="no task is installed"):
        route("make dumplings", {"empty": module("empty", ())})


def test_a_word_without_letters_matches_nothing() -> None:
    blank = module("m", (), task("a", ("!!",), "wrapper_aligned"))
    with pytest.raises(RoutingError, match="no installed module provides"):
        route("do it!!", {"m": blank})


def test_a_module_that_is_installed_and_not_active_is_named_where_it_is_the_only_one() -> None:
    with pytest.raises(RoutingError) as refused:
        route("make dumplings", {"clean": CLEAN}, lambda: {"dumpling": DUMPLING})
    assert refused.value.reason == (
        "no active module provides `make dumplings`; installed is `dumpling.make_dumplings`"
        " (`aeros activate dumpling`)"
    )
    with pytest.raises(RoutingError, match="no installed module provides `fly`; nearest: `clean`"):
        route("fly", {"clean": CLEAN}, lambda: {"dumpling": DUMPLING})


def test_inactive_modules_are_not_read_where_a_task_is_found() -> None:
    def unread() -> dict[str, Ecm]:
        raise AssertionError

    assert str(route("clean", {"clean": CLEAN}, unread)) == "clean.clean_table"
