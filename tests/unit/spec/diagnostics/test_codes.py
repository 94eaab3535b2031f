"""Diagnostics as data: what is kept, in which order, and what refuses."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.codes import (
    CODES,
    Diagnostic,
    Diagnostics,
    Severity,
    SpanLabel,
    did_you_mean,
    quoted,
)
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.source import Source, SourceSpan

A, B = Source("a.yaml", "0123456789"), Source("b.yaml", "0123456789")
WARNING = Diagnostic("AE408", "blocked", severity=Severity.WARNING)


def at(span: SourceSpan, headline: str = "a problem", code: str = "AE101") -> Diagnostic:
    return Diagnostic(code, headline, SpanLabel(span))


def test_codes_are_found_by_their_ids_in_order() -> None:
    assert list(CODES) == sorted(CODES)
    assert all(name == one.id for name, one in CODES.items())
    assert CODES["AE001"].slug == "duplicate-key"


def test_a_code_that_is_not_registered_is_refused() -> None:
    with pytest.raises(MisuseError, match="'AE000' is not in the registry"):
        Diagnostic("AE000", "a problem")


def test_problems_are_listed_by_file_and_position_and_those_without_a_place_first() -> None:
    sorted_ = [
        Diagnostic("AE101", "nowhere"),
        at(A.span(1, 2)),
        at(A.span(1, 3)),
        at(A.span(1, 3), code="AE102"),
        at(A.span(1, 3), "b problem", code="AE102"),
        at(A.span(5, 5)),
        at(B.span(0, 1)),
    ]
    sink = Diagnostics()
    for one in reversed(sorted_):
        sink.report(one)
    assert list(sink) == sorted_
    assert len(sink) == 7
    assert sorted_[0].sort_key == ("", -1, -1, "AE101", "nowhere")


def test_a_problem_is_kept_once() -> None:
    sink = Diagnostics(limit=1)
    sink.report(at(A.span(0, 1)))
    sink.report(at(A.span(0, 1)))
    assert (len(sink), sink.dropped) == (1, 0)


def test_only_cases_beyond_the_limit_of_their_severity_are_counted() -> None:
    sink = Diagnostics(limit=2)
    sink.report(at(A.span(0, 1)))
    assert (sink.is_full, sink.dropped) == (False, 0)
    sink.report(at(A.span(1, 2)))
    assert sink.is_full
    sink.report(at(A.span(2, 3)))
    sink.report(WARNING)
    assert (len(sink), sink.dropped) == (3, 1)
    assert [one.primary for one in sink][1:] == [SpanLabel(A.span(0, 1)), SpanLabel(A.span(1, 2))]


def test_two_hundred_problems_of_a_severity_are_kept() -> None:
    sink = Diagnostics()
    for number in range(201):
        sink.error("AE101", f"problem {number}")
    assert (len(sink), sink.dropped) == (200, 1)


def test_an_error_is_reported_with_its_notes_and_help() -> None:
    sink = Diagnostics()
    other = SpanLabel(B.span(0, 1), "the other")
    sink.error("AE101", "first", A.span(3, 4), "here", secondary=[other], notes=["why"], help=["do"])
    sink.error("AE102", "second")
    assert list(sink) == [
        Diagnostic("AE102", "second"),
        Diagnostic("AE101", "first", SpanLabel(A.span(3, 4), "here"), (other,), ("why",), ("do",)),
    ]


def test_errors_alone_refuse() -> None:
    sink = Diagnostics()
    sink.raise_if_errors()
    sink.report(WARNING)
    kinds = [sink.has_errors]
    sink.raise_if_errors()
    sink.error("AE101", "a problem")
    assert [*kinds, sink.has_errors] == [False, True]
    with pytest.raises(UserError) as raised:
        sink.raise_if_errors()
    assert raised.value.diagnostics == tuple(sink)


def test_a_collection_takes_in_another_with_what_that_dropped() -> None:
    one, other = Diagnostics(limit=2), Diagnostics(limit=1)
    one.error("AE101", "both")
    for name in ("both", "dropped there"):
        other.error("AE101", name)
    other.report(WARNING)
    one.extend(other)
    assert ([d.headline for d in one], one.dropped) == (["both", "blocked"], 1)


def test_the_nearest_name_is_suggested_if_any_is_near() -> None:
    names = ["human_distance", "held", "speed"]
    assert did_you_mean("human_distnace", names) == "human_distance"
    assert did_you_mean("sped", iter(names)) == "speed"
    assert did_you_mean("xyz", names) is None
    assert did_you_mean("speed", []) is None


def test_a_name_longer_than_any_is_not_compared() -> None:
    assert did_you_mean("a" * 64, ["a" * 63]) == "a" * 63
    assert did_you_mean("a" * 65, ["a" * 65]) is None


@given(st.text(max_size=80), st.integers(1, 70))
def test_quoted_text_is_the_whole_or_the_beginning_with_a_mark(text: str, longest: int) -> None:
    found = quoted(text, longest)
    assert found[0] == found[-1] == "`"
    if len(text) <= longest:
        assert found == f"`{text}`"
    else:
        assert len(found) == longest + 2
        assert found[-2] == "…"
        assert text.startswith(found[1:-2])


def test_text_is_shortened_to_sixty_characters() -> None:
    assert quoted("a" * 60) == f"`{'a' * 60}`"
    assert quoted("a" * 61) == f"`{'a' * 59}…`"
