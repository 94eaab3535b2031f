from __future__ import annotations

import json
import time

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
from aeros.spec.diagnostics.render import escape_invisible, render_all, render_json, render_text
from aeros.spec.diagnostics.source import Source, SourceSpan

MANIFEST = Source(
    "ecms/pick/ecm.yaml",
    "name: pick\n" + "\n" * 28 + "skills:\n" + "    require: max_speed <= reach\n" + "    timeout: 5 s\n",
)


def part(text: str, source: Source = MANIFEST) -> SourceSpan:
    start = source.text.index(text)
    return source.span(start, start + len(text))


def error(*labels: SpanLabel, headline: str = "it is wrong", **rest: tuple[str, ...]) -> Diagnostic:
    return Diagnostic("AE103", headline, labels[0] if labels else None, labels[1:], **rest)  # type: ignore[arg-type]


def test_of_two_labels_on_a_line_the_last_is_next_to_its_dashes_and_the_first_below() -> None:
    found = error(
        SpanLabel(part("max_speed"), "m/s"),
        SpanLabel(part("reach"), "m"),
        headline="`max_speed` is compared with `reach`",
        notes=("`max_speed` is declared at ecms/pick/ecm.yaml:12:5",),
        help=("compare with a speed, or divide `reach` by a duration",),
    )
    assert (
        render_text(found)
        == """\
error[AE103] wrong-kind: `max_speed` is compared with `reach`
  --> ecms/pick/ecm.yaml:31:14
31 |     require: max_speed <= reach
   |              ^^^^^^^^^    ----- m
   |              m/s
note: `max_speed` is declared at ecms/pick/ecm.yaml:12:5
help: compare with a speed, or divide `reach` by a duration
"""
    )


def test_three_labels_on_a_line_are_separated_by_vertical_bars() -> None:
    found = error(
        SpanLabel(part("<="), "here"), SpanLabel(part("max_speed"), "left"), SpanLabel(part("reach"), "right")
    )
    assert (
        render_text(found)
        == """\
error[AE103] wrong-kind: it is wrong
  --> ecms/pick/ecm.yaml:31:14
31 |     require: max_speed <= reach
   |              --------- ^^ ----- right
   |              |         here
   |              left
""".replace(":31:14", ":31:24")
    )


def test_labels_on_other_lines_and_in_other_files() -> None:
    site = Source("site.yaml", "limits:\n  max_speed: 1 m/s\n")
    found = error(
        SpanLabel(part("reach"), "too far"),
        SpanLabel(part("pick"), "in this module"),
        SpanLabel(part("timeout")),
        SpanLabel(part("max_speed", site), "declared here"),
    )
    assert (
        render_text(found)
        == """\
error[AE103] wrong-kind: it is wrong
  --> ecms/pick/ecm.yaml:31:27
 1 | name: pick
   |       ---- in this module
...
31 |     require: max_speed <= reach
   |                           ^^^^^ too far
32 |     timeout: 5 s
   |     -------
  ::: site.yaml:2:3
 2 |   max_speed: 1 m/s
   |   --------- declared here
"""
    )


def test_a_problem_of_no_place_is_a_headline_with_advice() -> None:
    found = Diagnostic("AE002", "`a.yaml` cannot be read", help=("check the path",))
    assert (
        render_text(found)
        == """\
error[AE002] unreadable-file: `a.yaml` cannot be read
help: check the path
"""
    )


def test_a_text_in_a_block_is_marked_on_each_of_its_lines() -> None:
    source = Source("a", "ab: >- # why\n  cd\n\n  efg\n\nh: i\n")
    shown = render_text(error(SpanLabel(source.span(4, 24), "here")))
    assert shown.endswith("1 | ab: >- # why\n2 |   cd\n  |   ^^\n...\n4 |   efg\n  |   ^^^ here\n")
    assert render_text(error(SpanLabel(source.span(4, 22)))).endswith("4 |   efg\n  |   ^\n")
    long = Source("a", "ab: |\n" + "  cd\n" * 20)
    assert render_text(error(SpanLabel(long.span(4, len(long.text))))).count("^^") == 8


def test_an_empty_span_is_one_caret_and_a_span_of_lines_is_marked_on_its_first() -> None:
    source = Source("a", "ab: x\n  cd\n")
    assert (
        render_text(error(SpanLabel(source.span(2, 2), "end")))
        == """\
error[AE103] wrong-kind: it is wrong
 --> a:1:3
1 | ab: x
  |   ^ end
"""
    )
    assert "\n1 | ab: x\n  |     ^\n" in render_text(error(SpanLabel(source.span(4, 10))))
    assert render_text(error(SpanLabel(source.span(11, 11)))).endswith(" --> a:3:1\n3 |\n  | ^\n")


def test_carets_lie_over_dashes() -> None:
    source = Source("a", "abcdef\n")
    text = render_text(error(SpanLabel(source.span(2, 4), "in"), SpanLabel(source.span(0, 6), "out")))
    assert text.endswith("1 | abcdef\n  | --^^--\n  | | in\n  | out\n")


def test_several_lines_of_a_note_stay_under_it() -> None:
    found = error(notes=("it happens when\nspeed = 3/10 m/s\nerror[AE001] posing",))
    assert render_text(found).endswith(
        "note: it happens when\n      speed = 3/10 m/s\n      error[AE001] posing\n"
    )


def test_wide_characters_tabs_and_controls_keep_the_mark_in_place() -> None:
    source = Source("a", "日本:\t\x1b[2J\u202e: here\n")
    assert render_text(error(SpanLabel(part("here", source)))) == (
        "error[AE103] wrong-kind: it is wrong\n"
        " --> a:1:11\n"
        "1 | 日本:    \\x1b[2J\\u202e: here\n"
        "  |                         ^^^^\n"
    ).replace("a:1:11", f"a:1:{source.text.index('here') + 1}")


def test_a_long_line_is_shown_around_its_mark() -> None:
    source = Source("a", "x" * 500 + "HERE" + "y" * 500)
    rows = render_text(error(SpanLabel(part("HERE", source), "this"))).splitlines()
    assert rows[1] == " --> a:1:501"
    assert rows[2] == "1 | …" + "x" * 40 + "HERE" + "y" * 116 + "…"
    assert rows[3] == "  |  " + " " * 40 + "^^^^ this"
    start = render_text(error(SpanLabel(source.span(0, 2)))).splitlines()
    assert start[2] == "1 | " + "x" * 160 + "…"


def test_colour_appears_only_when_asked_for_and_changes_nothing_else() -> None:
    found = error(
        SpanLabel(part("max_speed"), "m/s"), SpanLabel(part("reach"), "m"), notes=("n",), help=("h",)
    )
    coloured = render_text(found, paint=lambda text, role: f"<{role}>{text}</>")
    assert "<error>error[AE103]</> wrong-kind" in coloured
    assert "<error>^^^^^^^^^</>" in coloured
    plain = coloured
    for mark in ("</>", "<error>", "<gutter>", "<secondary>", "<note>", "<help>"):
        plain = plain.replace(mark, "")
    assert plain == render_text(found)


@given(st.text(max_size=300), st.text(max_size=30), st.data())
def test_nothing_from_a_file_reaches_the_terminal_as_control(
    text: str, message: str, data: st.DataObject
) -> None:
    source = Source(message, text)
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, len(text)))
    found = error(
        SpanLabel(source.span(start, end), message), SpanLabel(source.span(0, end), message), headline=message
    )
    shown = render_text(found)
    assert all(character == "\n" or escape_invisible(character) == character for character in shown)
    assert shown.startswith("error[AE103]")
    json.dumps(render_json(found))
    shown.encode()


def test_a_megabyte_on_one_line_is_rendered_in_time() -> None:
    source = Source("a", "\x1b" * 1_000_000)
    began = time.monotonic()
    shown = render_text(error(SpanLabel(source.span(0, 1_000_000)), headline=source.text))
    assert time.monotonic() - began < 2.0
    assert len(shown) < 30_000


def test_json_has_everything_a_program_needs() -> None:
    found = error(SpanLabel(part("reach"), "m"), SpanLabel(part("pick")), notes=("n",), help=("h",))
    assert json.loads(json.dumps(render_json(found))) == {
        "code": "AE103",
        "slug": "wrong-kind",
        "group": "form",
        "severity": "error",
        "headline": "it is wrong",
        "primary": {
            "path": "ecms/pick/ecm.yaml",
            "line": 31,
            "column": 27,
            "end_line": 31,
            "end_column": 32,
            "start": 73,
            "end": 78,
            "text": "m",
        },
        "secondary": [
            {
                "path": "ecms/pick/ecm.yaml",
                "line": 1,
                "column": 7,
                "end_line": 1,
                "end_column": 11,
                "start": 6,
                "end": 10,
                "text": "",
            }
        ],
        "notes": ["n"],
        "help": ["h"],
    }


# --- the data that is rendered


def test_the_registry_is_sorted() -> None:
    assert list(CODES) == sorted(CODES)
    assert all(code.id == name for name, code in CODES.items())


def test_an_unregistered_code_is_misuse() -> None:
    with pytest.raises(MisuseError):
        Diagnostic("AE000", "no such code")


def test_diagnostics_are_sorted_by_file_and_place_without_repetitions() -> None:
    other = Source("a.yaml", "xy")
    found = [
        error(SpanLabel(part("reach"))),
        error(SpanLabel(part("pick"))),
        error(SpanLabel(other.span(1, 2))),
        Diagnostic("AE002", "nowhere"),
    ]
    sink = Diagnostics()
    for diagnostic in found + found:
        sink.report(diagnostic)
    assert list(sink) == [found[3], found[2], found[1], found[0]]
    assert len(sink) == 4
    assert render_all(sink).count("\n\n") == 3


def test_diagnostics_are_limited_and_warnings_never_crowd_out_errors() -> None:
    sink = Diagnostics(limit=2)
    for number in range(5):
        sink.report(Diagnostic("AE002", f"warning {number}", severity=Severity.WARNING))
    sink.raise_if_errors()
    for number in range(5):
        sink.error("AE002", f"error {number}")
    assert sink.has_errors
    assert sink.is_full
    assert (len(sink), sink.dropped) == (4, 6)
    with pytest.raises(UserError) as raised:
        sink.raise_if_errors()
    assert len(raised.value.diagnostics) == 4


def test_extending_includes_each_diagnostic_once_and_counts_the_dropped_ones() -> None:
    one, other = Diagnostics(limit=2), Diagnostics(limit=2)
    for number in range(3):
        one.error("AE002", f"error {number}")
    other.error("AE002", "error 1")
    other.extend(one)
    assert [found.headline for found in other] == ["error 0", "error 1"]
    assert (other.dropped, other.has_errors) == (1, True)


def test_near_names_are_suggested_and_far_or_endless_ones_are_not() -> None:
    assert did_you_mean("timout", ["timeout", "name"]) == "timeout"
    assert did_you_mean("zzz", ["timeout", "name"]) is None
    assert did_you_mean("timeout" * 100_000, ["timeout"]) is None
    assert quoted("x" * 100) == "`" + "x" * 59 + "…`"
