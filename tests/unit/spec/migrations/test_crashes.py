"""The list of crashes becomes an object, with room for its version."""

from __future__ import annotations

import json
from pathlib import PurePath

import pytest

from aeros.spec.migrations import formats
from aeros.spec.migrations.crashes import to_2
from aeros.spec.migrations.format import UnmigratableError
from aeros.spec.migrations.rewriting import rewrite


def test_crashes_of_version_1_are_kept() -> None:
    new = rewrite(PurePath("crashes.json"), '[[1.0, "why"]]', formats.CRASHES)
    assert json.loads(new.text) == {"schema": "aeros/crashes/2", "crashes": [[1.0, "why"]]}
    with pytest.raises(UnmigratableError, match="damaged"):
        rewrite(PurePath("crashes.json"), "{}", formats.CRASHES)


def test_no_crash_is_a_list_too_and_anything_else_is_refused() -> None:
    assert json.loads(to_2("[]")) == {"schema": formats.CRASHES.schema, "crashes": []}
    for text in ("3", '{"schema": "aeros/crashes/1"}', "null"):
        with pytest.raises(UnmigratableError, match="it is damaged"):
            to_2(text)
    with pytest.raises(ValueError, match="Expecting value"):
        to_2("")
