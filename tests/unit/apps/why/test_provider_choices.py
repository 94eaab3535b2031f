"""A choice is explained from its note, also from one of an older version."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.apps.why.provider_choices import explain_choice


def test_a_note_without_a_reason_is_explained_by_its_records() -> None:
    record = {"successes": 1, "failures": 0}
    details = {"skill": "a.b", "capability": "a.c", "options": [{"skill": "b", "record": record}]}
    text, causes = explain_choice(details)
    assert text == "a.b was chosen for `a.c`: its record, no other reason is written down"
    assert [str(one) for one in causes] == ["b: 1 successes and 0 failures in this context"]


@pytest.mark.parametrize("options", [None, {}, [None, 3], [{"skill": "b", "record": [1]}]])
def test_an_entry_that_is_no_option_is_skipped(options: Any) -> None:
    assert explain_choice({"options": options})[1] == ()
