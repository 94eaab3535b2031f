"""Audit records as text: filters, and the measured values and rules behind each reason."""

from __future__ import annotations

import argparse
from dataclasses import replace
from datetime import datetime
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.records.show import (
    add_filters,
    decision_reasons,
    explain_record,
    format_record,
    matches_filters,
)
from aeros.runtime.audit.check import Record
from aeros.spec.diagnostics.codes import CODES, Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from tests.hypothesis_profiles import examples
from tests.unit.runtime import bench

MOVE = {"kind": "move", "parameters": {"speed": 0.5, "target": [0.25, 0.0, 1.0]}}


@cache
def site() -> Site:
    found = load_site(bench.SITE, Diagnostics())
    assert found is not None
    return found


def filters(*options: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_filters(parser)
    return parser.parse_args(options)


def record(
    event: str = "decision", /, *, sequence: int = 5, written: float = 1000.0, **details: Any
) -> Record:
    return {"event": event, "sequence": sequence, "written": written, "previous": "", "details": details}


def denied(code: str, rule: str, text: str = "no", **details: Any) -> Record:
    return record(verdict="DENY", reasons=[[code, rule, text]], **details)


DENIAL = denied("AE750", "separation", module="handling", skill="slowly", asked=MOVE)


@pytest.mark.parametrize(
    ("options", "matches"),
    [
        ((), True),
        (("--decision", "DENY"), True),
        (("--decision", "ALLOW"), False),
        (("--decision", "ALLOW", "--decision", "DENY"), True),
        (("--module", "handling"), True),
        (("--module", "hand"), False),
        (("--skill", "slowly"), True),
        (("--skill", "handling.slowly"), True),
        (("--skill", "other.slowly"), False),
        (("--kind", "move"), True),
        (("--kind", "carry"), False),
        (("--rule", "separation"), True),
        (("--rule", "AE750"), True),
        (("--rule", "no"), False),
        (("--event", "decision"), True),
        (("--event", "note"), False),
        (("--decision", "DENY", "--kind", "carry"), False),
        (("--from-record", "5", "--to-record", "5"), True),
        (("--from-record", "6"), False),
        (("--to-record", "4"), False),
        (("--since", "1970-01-01T00:16:40+00:00"), True),
        (("--since", "1970-01-01T00:16:41+00:00"), False),
        (("--until", "1970-01-01T00:16:40+00:00"), True),
        (("--until", "1970-01-01T00:16:39+00:00"), False),
    ],
)
def test_a_record_is_selected_by_all_of_its_options(options: tuple[str, ...], *, matches: bool) -> None:
    assert matches_filters(DENIAL, filters(*options)) is matches


@pytest.mark.parametrize(
    ("event", "wanted", "matches"),
    [
        ("run-ended", "run-ended", True),
        ("run-ended", "note", True),
        ("run-ended", "step-ended", False),
        ("goal-refused", "goal-refused", True),  # its old name
        ("goal-refused", "goal-rejected", True),
        (["run-ended"], "run-ended", False),
    ],
)
def test_a_note_is_selected_by_its_event(event: object, wanted: str, *, matches: bool) -> None:
    assert matches_filters(record("note", event=event), filters("--event", wanted)) is matches
    assert not matches_filters(record("stopped", event=event), filters("--event", wanted))


def test_a_disagreement_is_shown_with_both_verdicts() -> None:
    outcomes: dict[str, Any] = {"compiled": {"verdict": "ALLOW"}, "z3": {"verdict": "DENY"}}
    shown = format_record(record("gate-disagreement", module="m", skill="s", **outcomes), None)
    assert "gate-disagreement  compiled ALLOW, z3 DENY  m.s asks for null" in shown


def test_the_verdict_of_what_is_no_decision_matches_nothing() -> None:
    noted = record("note", verdict="DENY", asked="move", reasons=[["AE750", "separation", "no"]])
    assert not matches_filters(noted, filters("--decision", "DENY"))
    assert not matches_filters(noted, filters("--rule", "separation"))
    assert not matches_filters(noted, filters("--kind", "move"))


def test_a_time_that_is_none_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        filters("--since", "noon")
    assert ended.value.code == 2
    assert "expected a date and time, as 2026-11-21T05:16:28" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("reasons", "found"),
    [
        ([["AE1", "r", "t"], ["AE2", 3, None]], [("AE1", "r", "t"), ("AE2", "3", "None")]),
        ([["AE1", "r"], "AE2", None, ["a", "b", "c", "d"]], []),
        ("AE1", []),
        (None, []),
    ],
)
def test_reasons_are_triples(reasons: Any, found: list[tuple[str, str, str]]) -> None:
    assert decision_reasons(record(reasons=reasons)) == found
    assert decision_reasons(record("note", reasons=reasons)) == []


# One line.


def line(one: Record) -> str:
    return format_record(one, None).splitlines()[0]


def test_a_line_has_number_time_event_and_summary() -> None:
    written = datetime.fromtimestamp(1000.0).astimezone().isoformat(" ", "milliseconds")
    entry = record(verdict="ALLOW", module="m", skill="s", asked=MOVE, time=2.0)
    assert line(entry) == (
        f"     5  {written}  decision        ALLOW      m.s asks for"
        " move(speed=0.5, target=[0.25, 0.0, 1.0]) at 2.000 s"
    )


@pytest.mark.parametrize(
    ("one", "ending"),
    [
        (
            record(verdict="DENY", module="m", skill="s", asked=None, time=3),
            "DENY       m.s asks for null at 3",
        ),
        (
            record("step-ended", module="m", skill="s", status="denied", reason="r"),
            "step-ended      m.s: denied: r",
        ),
        (record("note", event="plan"), "note            plan-accepted"),
        (record("note", event="plan-rejected"), "note            plan-rejected"),
        (record("note", count=1), 'note            {"count": 1}'),
        (record("note", event="x\x1b[2J"), "note            x\\x1b[2J"),
    ],
)
def test_a_field_that_a_record_lacks_is_left_out(one: Record, ending: str) -> None:
    assert line(one).endswith(ending)


def test_a_time_that_no_calendar_has_is_reported() -> None:
    assert "  at no time  " in line(record("note", written=1e300))


def test_a_line_is_cut_and_reasons_follow_indented() -> None:
    text = format_record(denied("AE750", "separation", "x" * 500, module="m" * 500), None).splitlines()
    assert len(text[0]) == 400
    assert text[1] == "        AE750 separation: " + "x" * 500


# Why.


def explained(one: Record) -> list[str]:
    return explain_record(one, site())


def test_a_rule_is_explained_with_what_was_asked_and_measured() -> None:
    state = {"human_distance": [1.0, 99.95]}
    found = explained(denied("AE750", "near-person", "too fast", asked=MOVE, state=state, time=100.0))
    assert found[0] == "AE750 near-person: too fast"
    assert found[1] == f"   AE750 means: {CODES['AE750'].summary}"
    assert found[2].startswith("   the rule is written at ")
    assert found[2].endswith(", and comes from: risk assessment")
    assert found[3:] == [
        "   `human_distance` was 1 m, measured 0.05 s before",
        "   requested `speed` = 0.5 m/s",
    ]


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({}, "`human_distance` was not measured"),
        ("none", "`human_distance` was not measured"),
        ({"human_distance": 1.0}, "`human_distance` was not measured"),
        ({"human_distance": [1.0]}, "`human_distance` was not measured"),
        ({"human_distance": [0.25, None]}, "`human_distance` was 0.25 m"),
        ({"human_distance": ["far", 100.0]}, '`human_distance` was "far", measured 0 s before'),
        ({"human_distance": [1e999, 98.0]}, "`human_distance` was Infinity, measured 2 s before"),
    ],
)
def test_a_value_is_shown_as_it_was_recorded(state: Any, message: str) -> None:
    found = explained(denied("AE750", "separation", asked=MOVE, state=state, time=100.0))
    assert found[-1] == f"   {message}"


def test_vectors_and_families_have_units_in_each_part() -> None:
    state = {"hand": [[0.25, 0.0, 0.5], 100.0]}
    found = explained(denied("AE750", "short-reach", asked=MOVE, state=state, time=100.0))
    assert found[3:] == [
        "   `hand` was [0.25 m, 0 m, 0.5 m], measured 0 s before",
        "   requested `target` = [0.25 m, 0 m, 1 m]",
    ]


def test_an_action_that_the_rule_does_not_govern_has_no_inputs() -> None:
    for asked in ({"kind": "stop", "parameters": {}}, {"kind": "move"}, "move", None):
        found = explained(denied("AE750", "separation", asked=asked))
        assert len(found) == 3


@pytest.mark.parametrize(
    ("usage", "used"), [({"carry-rate": 3}, "3"), ({}, "an unknown number"), (None, "an unknown number")]
)
def test_a_quota_says_how_much_was_used(usage: Any, used: str) -> None:
    found = explained(denied("AE742", "carry-rate", usage=usage))
    assert found[2:] == [f"   of 3 actions within 60 s, {used} had been executed"]


def test_a_field_of_the_state_says_where_it_is_declared() -> None:
    declared, measured = explained(denied("AE703", "stop_pressed", state={"stop_pressed": [True, 1.0]}))[2:]
    assert declared.startswith("   it is declared at ")
    assert measured == "   `stop_pressed` was true"


def test_an_override_says_where_it_is_written_and_one_of_the_operator_does_not() -> None:
    block = denied("AE710", "worn")
    span = site().rules[0].require_span
    written = OperatorOverride("worn", "a finger is worn", None, None, "move", span=span)
    assert explain_record(block, replace(site(), blocks=(written,)))[2:] == [
        f"   the operator override is written at {span}"
    ]
    assert len(explained(block)) == 2


@pytest.mark.parametrize(
    ("code", "rule"), [("AE750", "unheard-of"), ("AE751", "x"), ("AE742", "x"), ("AE101", "x")]
)
def test_a_rule_that_the_site_lacks_has_no_place(code: str, rule: str) -> None:
    assert len(explained(denied(code, rule))) == 2


def test_a_code_of_another_version_says_so() -> None:
    assert explained(denied("AE000", "x"))[1] == "   AE000 means: not a code of this version"


def test_an_attenuation_says_to_what_and_a_joint_decision_with_whom() -> None:
    asked = {"kind": "move", "parameters": {"speed": 0.25}}
    reasons = [["AE750", "near-person", "too fast"]]
    found = explain_record(record(verdict="ATTENUATE", reasons=reasons, decided=asked, beside=[3, 4]), None)
    assert found[2:] == ["decided jointly with the actions of records 3, 4", "attenuated to move(speed=0.25)"]
    assert explain_record(record(verdict="ATTENUATE", decided=asked, beside=[3]), None) == []


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
)
_DETAILS = st.dictionaries(
    st.sampled_from(["verdict", "reasons", "asked", "state", "time", "usage", "beside", "module", "decided"]),
    _VALUES,
)
_REASONS = st.lists(
    st.tuples(
        st.sampled_from(["AE750", "AE751", "AE742", "AE710", "AE703"]),
        st.sampled_from(["separation", "short-reach", "carry-rate", "hand", "joint_angle"]),
        st.text(max_size=4),
    ).map(list),
    max_size=2,
)


@examples(25)
@given(_DETAILS, _REASONS)
def test_every_record_is_shown(details: dict[str, Any], reasons: list[list[str]]) -> None:
    shown = format_record(record(**{**details, "reasons": reasons}), site())
    assert "\x1b" not in shown


def test_numbers_digests_and_versions_are_short_for_people() -> None:
    asked = {"kind": "move", "parameters": {"speed": 0.1 + 0.2, "target": [0.1 + 0.2, 1, 2.0]}}
    text = format_record(record(verdict="ALLOW", module="a", skill="b", asked=asked, time=0.1 + 0.2), None)
    assert text.endswith("ALLOW      a.b asks for move(speed=0.3, target=[0.3, 1, 2.0]) at 0.300 s")
    modules = {"tidy": {"code": "a" * 64, "manifest": "b" * 64, "version": "1.0.0"}}
    text = format_record(record("session-opened", configuration="0f" * 32, modules=modules), None)
    assert text.endswith('{"configuration": "0f0f0f0f0f0f…", "modules": {"tidy": "1.0.0"}}')
    assert format_record(record("x", much="z" * 500), None).endswith("z…")
    assert format_record(record("x", time=1796140000.1234), None).endswith('{"time": 1796140000.123}')
