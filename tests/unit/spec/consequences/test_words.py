"""The words on a predicate that is not known any more."""

from __future__ import annotations

from dataclasses import replace

from aeros.spec.consequences.words import unsettled_note
from tests.unit.agent.dumplings import outcome
from tests.unit.spec.consequences.places import asking

GO = replace(
    asking("go", replace(outcome("gone", {}), consequences={"docked": None})), disturbed={"docked": "`base`"}
)


def test_the_note_names_predicate_reading_step_and_cure() -> None:
    assert unsettled_note({"docked"}, [("stay", asking("stay")), ("drive", GO)]) == (
        "`docked` is defined by `base`, which `drive` may change, so it may be either afterwards: "
        "state `docked` as an effect of `go`, or run a step that makes it true again"
    )


def test_there_is_no_note_where_nothing_read_is_left_open() -> None:
    assert unsettled_note({"other"}, [("drive", GO)]) is None
    assert unsettled_note({"docked"}, []) is None
