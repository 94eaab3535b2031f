"""Edits of YAML change the places that a path leads to, and no other byte."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.migrations.format import UnmigratableError
from aeros.spec.migrations.yaml_edits import EACH, parse, rename_key, schema_of, set_value, yaml_step
from aeros.spec.text.nodes import MappingNode

TEXT = """\
# a: comment
schema: aeros/it/1   # stays
a: 1
'b': {a: 2, "a b": 3, c: [{a: 4}, {a: 5, d: a}]}
e:
- a: "x"
  f: {a: 'y'}
- g
"""


def test_two_keys_are_not_made_one() -> None:
    with pytest.raises(UnmigratableError, match="`a` becomes `b`, which line 2 has already"):
        rename_key("a: 1\nb: 2\n", ["a"], "b")


def test_malformed_yaml_is_refused_at_its_place() -> None:
    with pytest.raises(UserError, match="AE009"):
        rename_key('a: "', ["a"], "b")


def test_a_key_is_renamed_at_the_end_of_its_path_alone() -> None:
    assert rename_key(TEXT, ["a"], "z") == TEXT.replace("\na: 1", "\nz: 1")
    assert rename_key(TEXT, ["b", "a"], "longer") == TEXT.replace("{a: 2", "{longer: 2")
    assert rename_key(TEXT, ["e", EACH, "f", "a"], "z") == TEXT.replace("{a: 'y'", "{z: 'y'")
    assert rename_key(TEXT, ["b", "c", EACH, "a"], "zz") == TEXT.replace("{a: 4", "{zz: 4").replace(
        "{a: 5", "{zz: 5"
    )
    assert rename_key(TEXT, [EACH, "a"], "z") == TEXT.replace("{a: 2", "{z: 2")


def test_a_path_that_leads_nowhere_changes_nothing() -> None:
    for path in (["none"], ["a", "a"], ["e", "a"], ["e", EACH, "f", "none"], ["schema", EACH, "a"]):
        assert rename_key(TEXT, path, "z") == TEXT
        assert set_value(TEXT, path, "z") == TEXT


def test_quotes_stay_as_they_are() -> None:
    assert rename_key(TEXT, ["b"], "z") == TEXT.replace("'b'", "'z'")
    assert rename_key(TEXT, ["b", "a b"], "z") == TEXT.replace('"a b"', '"z"')
    assert set_value(TEXT, ["e", EACH, "a"], "z") == TEXT.replace('"x"', '"z"')
    assert set_value(TEXT, ["e", EACH, "f", "a"], "z") == TEXT.replace("'y'", "'z'")


def test_only_single_values_are_replaced() -> None:
    assert set_value(TEXT, ["a"], "12") == TEXT.replace("a: 1", "a: 12")
    assert set_value(TEXT, [EACH], "9") == TEXT.replace("aeros/it/1", "9").replace("\na: 1", "\na: 9")
    assert set_value(TEXT, ["e", EACH], "h") == TEXT.replace("- g", "- h")


def test_two_names_clash_only_in_one_mapping() -> None:
    assert rename_key("- {a: 1}\n- {b: 2}\n", [EACH, "a"], "b") == "- {b: 1}\n- {b: 2}\n"
    with pytest.raises(UnmigratableError, match="which line 3 has already"):
        rename_key("- {a: 1}\n- a: 2\n  b: 3\n", [EACH, "a"], "b")
    assert rename_key("b: 1\n", ["a"], "b") == "b: 1\n"


def test_a_step_edits_and_then_sets_the_version() -> None:
    step = yaml_step("aeros/it/2", lambda text: rename_key(text, ["a"], "z"))
    assert step(TEXT) == TEXT.replace("\na: 1", "\nz: 1").replace("aeros/it/1", "aeros/it/2")


def test_the_version_is_found_with_its_place() -> None:
    found = schema_of(TEXT, "it.yaml")
    assert found is not None
    value, span = found
    assert (value, span.text, span.line, span.source.path) == ("aeros/it/1", "aeros/it/1", 2, "it.yaml")
    assert schema_of("a: {schema: x}\n") is None
    assert schema_of("schema: [x]\n") is None
    assert schema_of("- schema\n") is None


def test_text_is_parsed_or_refused_with_its_path() -> None:
    assert isinstance(parse("a: 1\n"), MappingNode)
    with pytest.raises(UserError) as raised:
        parse("a: [1\n", "it.yaml")
    (problem,) = raised.value.diagnostics
    assert problem.primary is not None
    assert problem.primary.span.source.path == "it.yaml"
