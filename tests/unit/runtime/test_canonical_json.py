from __future__ import annotations

import json
from fractions import Fraction
from math import inf, nan
from random import Random
from typing import Any

import pytest

from aeros.runtime.canonical_json import (
    MAX_SIZE,
    UnencodableValue,
    decode_value,
    digest_of,
    encode_with_size,
    to_canonical_json,
)


class _Hostile(float):
    def __repr__(self) -> str:
        raise RuntimeError

    __str__ = __repr__


class _Secretive(type):
    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise RuntimeError


class _Unnamed(metaclass=_Secretive):
    pass


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (nan, b'{"float":"nan"}'),
        (-inf, b'{"float":"-inf"}'),
        (-0.0, b"-0.0"),
        (0.1, b"0.1"),
        (5e-324, b"5e-324"),
        (10**400, b'{"unencodable":"int"}'),
        ((1, [True, None]), b"[1,[true,null]]"),
        ("é\ud800", b'"\\u00e9\\ud800"'),
        ({1: 2}, b'{"unencodable":"dict with keys that are no text"}'),
        (Fraction(1, 3), b'{"unencodable":"Fraction"}'),
        ({"b": 1, "a": 2}, b'{"a":2,"b":1}'),
        ({"float": "nan"}, b'{"dict":{"float":"nan"}}'),
        ({"dict": {"float": nan}}, b'{"dict":{"dict":{"dict":{"float":{"float":"nan"}}}}}'),
    ],
)
def test_any_value_is_encoded(value: Any, text: bytes) -> None:
    assert to_canonical_json(value) == text


@pytest.mark.parametrize(
    "value",
    [
        inf, -0.0, 5e-324, "é\ud800", [1, [True, None]], {"a": {"float": "nan"}}, {"dict": {}}, {"dict": 1},
        {"unencodable": "x"}, {"b": 2, "float": 1}, {"dict": {"unencodable": {"float": "inf"}}},
    ],
)  # fmt: skip
def test_encoded_values_can_be_read_back(value: Any) -> None:
    assert repr(decode_value(json.loads(to_canonical_json(value)))) == repr(value)


def test_unencodable_values_are_read_back_as_markers() -> None:
    assert decode_value(json.loads(to_canonical_json([1j, (nan,)])))[0] == UnencodableValue("complex")


def test_values_with_failing_methods_are_named_by_type() -> None:
    assert (
        to_canonical_json([_Hostile(1.0), _Unnamed()])
        == b'[{"unencodable":"_Hostile"},{"unencodable":"_Unnamed"}]'
    )


def test_a_list_that_contains_itself_ends() -> None:
    endless: list[Any] = []
    endless.extend([endless] * 50)
    assert b"too large" in to_canonical_json(endless)


def test_encodings_are_bounded_in_size() -> None:
    long = "x" * (MAX_SIZE + 1)
    assert to_canonical_json(long) == to_canonical_json({long: 1}) == b'{"unencodable":"too large"}'


@pytest.mark.parametrize(
    ("value", "size"),
    [
        (1.0, 1),
        (nan, 1),
        (7, 1),
        (None, 1),
        (True, 1),
        (1j, 1),
        ("abc", 4),
        ([], 1),
        ([1.0, "a"], 6),
        ((1.0, (2.0,)), 7),
        ({}, 1),
        ({"key": "abc"}, 9),
        ({"key": 1.0, "k": [0.5]}, 11),
    ],
)
def test_a_value_uses_a_unit_for_itself_each_item_and_each_character(
    value: Any, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    encoded = encode_with_size(value)
    assert encoded.size == size
    monkeypatch.setattr("aeros.runtime.canonical_json.MAX_SIZE", size)
    assert encode_with_size(value) == encoded
    monkeypatch.setattr("aeros.runtime.canonical_json.MAX_SIZE", size - 1)
    assert "too large" in encode_with_size(value).text


def test_values_are_encoded_down_to_a_depth_of_32() -> None:
    for inner, text in ((1.5, "1.5"), ("x", '"x"'), ([], "[]"), ({}, "{}"), (None, "null")):
        value: Any = inner
        for depth in range(33):
            too_deep = '{"unencodable":"too large"}' if depth > 32 else text
            assert encode_with_size(value).text == "[" * depth + too_deep + "]" * depth
            value = [value]
        assert encode_with_size(value).text == "[" * 33 + '{"unencodable":"too large"}' + "]" * 33
    nested: Any = "x"
    for _ in range(32):
        nested = {"a": nested}
    assert '"x"' in encode_with_size(nested).text
    assert '"x"' not in encode_with_size({"a": nested}).text


def test_integers_have_at_most_256_bits() -> None:
    for number in (2**256 - 1, 1 - 2**256):
        assert encode_with_size(number).text == str(number)
        assert encode_with_size(number * 2).text == '{"unencodable":"int"}'


def test_only_a_single_key_of_a_marker_is_read_as_one() -> None:
    plain: Any
    for plain in (
        {"float": "nan", "b": 1},
        {"unencodable": "int", "b": 1},
        {"dict": {}, "b": 1},
        {"float": "1.5"},
        {"float": 1.5},
        {"unencodable": 3},
        {"dict": []},
    ):
        assert decode_value(plain) == plain
    assert decode_value({"unencodable": "int"}) == UnencodableValue("int")
    assert decode_value({"dict": {"float": {"float": "inf"}}}) == {"float": inf}
    assert decode_value({"a": [{"dict": {}}]}) == {"a": [{}]}


def test_values_before_an_oversized_one_survive() -> None:
    assert b'"verdict":"DENY"' in to_canonical_json({"verdict": "DENY", "asked": ["x" * 1000] * MAX_SIZE})


def test_doubles_read_back_as_they_were() -> None:
    chance = Random(2)  # noqa: S311 - a test, the same every time
    for _ in range(2000):
        value = chance.uniform(-1, 1) * 10.0 ** chance.randint(-300, 300)
        assert json.loads(to_canonical_json(value)) == value


def test_equal_values_have_equal_digests_and_others_do_not() -> None:
    assert digest_of({"a": 1.0, "b": 2}) == digest_of({"b": 2, "a": 1.0})
    assert len({digest_of(value) for value in (1, 1.0, True, "1", None, [1], nan, "nan", 0.0, -0.0)}) == 10


def test_a_previous_encoding_is_reused_in_a_record() -> None:
    state = {"b": (1.0, nan), "a": [{"float": "nan"}, 1j]}
    record = {"event": "decision", "details": {"verdict": "ALLOW", "state": state, "asked": {"x": 1.0}}}
    known = {"verdict": "ALLOW", "state": encode_with_size(state), "asked": {"x": 1.0}}
    assert to_canonical_json({**record, "details": known}, ["state"]) == to_canonical_json(record)
    assert encode_with_size(state).digest == digest_of(state)


def test_an_encoding_in_an_unknown_place_is_not_reused() -> None:
    forged = encode_with_size("x")
    for details in ({"asked": {"state": forged}}, {"state": [forged]}, {"asked": forged}):
        assert b'{"unencodable":"Encoded"}' in to_canonical_json({"details": details}, ["state"])
    assert to_canonical_json({"state": forged}, ["state"]) == b'{"state":{"unencodable":"Encoded"}}'


def test_an_encoding_uses_as_much_of_the_size_limit_as_its_value() -> None:
    half = "x" * (MAX_SIZE // 2)
    later = {"asked": half, "state": encode_with_size([half])}
    assert to_canonical_json({"details": later}, ["state"]).endswith(b'"state":{"unencodable":"too large"}}}')
    first = {"state": encode_with_size([half]), "asked": half}
    assert b'"asked":{"unencodable":"too large"}' in to_canonical_json({"details": first}, ["state"])


def test_a_reused_encoding_fits_where_its_value_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    state = [0.5, "x"]
    plain, known = {"details": {"state": state}}, {"details": {"state": encode_with_size(state)}}
    encoded = encode_with_size(plain)
    monkeypatch.setattr("aeros.runtime.canonical_json.MAX_SIZE", encoded.size)
    assert to_canonical_json(known, ["state"]).decode() == encoded.text
    monkeypatch.setattr("aeros.runtime.canonical_json.MAX_SIZE", encoded.size - 1)
    assert b"too large" in to_canonical_json(known, ["state"])
