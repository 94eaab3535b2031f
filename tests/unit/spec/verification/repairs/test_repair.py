from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction

import pytest
import z3

import aeros.spec.verification.repairs.edits
from aeros.spec.backends.oracle import Oracle
from aeros.spec.expr.units import exact_decimal
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import SubjectReport

Judge = Callable[..., SubjectReport]


def repairs(report: SubjectReport) -> set[str]:
    return {one.repair for one in report.findings if one.repair}


def repair(judge: Judge, kind: str, envelope: str, **more: object) -> str:
    (line,) = repairs(judge(kind, envelope, **more))
    return line.removeprefix(f"{kind}: ")


CASES = [
    ("wait", "duration <= 31 s", "duration <= 30 s"),
    ("wait", "duration <= 31000 ms", "duration <= 30000 ms"),
    ("wait", "duration <= 0.5 h", "duration <= 0.0083 h"),
    ("wait", "duration < 31 s", "duration < 30 s"),
    ("wait", "31 s >= duration", "30 s >= duration"),
    ("wait", "2 s <= duration <= 31 s", "2 s <= duration <= 30 s"),
    ("wait", "2 * duration <= 80 s", "2 * duration <= 60 s"),
    ("wait", "3 * duration <= 100 s and inputs.pause < 5 s", "3 * duration <= 90 s and inputs.pause < 5 s"),
    (
        "wait",
        "duration <= inputs.pause and inputs.pause < 31 s",
        "duration <= inputs.pause and inputs.pause < 30 s",
    ),
    ("wait", "true", "duration <= 30 s"),
    (
        "wait",
        "inputs.pause < 5 s or duration < 5 s",
        "(inputs.pause < 5 s or duration < 5 s) and duration <= 30 s",
    ),
    (
        "wait",
        "(inputs.pause < 5 s or duration < 5 s)",
        "(inputs.pause < 5 s or duration < 5 s) and duration <= 30 s",
    ),
    (
        "wait",
        "(inputs.pause < 5 s) or (duration < 5 s)",
        "((inputs.pause < 5 s) or (duration < 5 s)) and duration <= 30 s",
    ),
    ("turn", "abs(angle) <= 90 deg", "abs(angle) < 90 deg"),
    ("turn", "-90 deg <= angle <= 80 deg", "-90 deg < angle <= 80 deg"),
    ("turn", "-100 deg < angle < 1.7 rad", "-100 deg < angle < 1.7 rad and abs(angle) < 90 deg"),
    ("carry", "gait <= 101 mm/s", "gait <= 100 mm/s"),
    ("carry", "gait <= 0.1012 m/s", "gait <= 0.1 m/s"),
    ("approach", "true", "person_near implies pace <= slow"),
    (
        "wait",
        "duration <= (if person_near then 20 s else 31 s)",
        "duration <= (if person_near then 20 s else 30 s)",
    ),
    (
        "wait",
        "(if person_near then 5 s else -1 s) <= duration <= 31 s",
        "(if person_near then 5 s else -1 s) <= duration <= 30 s",
    ),
    (
        "approach",
        "pace <= (if person_near then 300 mm/s else 400 mm/s)",
        "pace <= (if person_near then 100 mm/s else 400 mm/s)",
    ),
    ("wipe", "pressure <= 5 N", "pressure <= 2 N"),
    ("wipe", "tool != knife and pressure <= 15 N", "tool != knife and pressure <= 10 N"),
    (
        "move",
        "target in tabletop and speed <= 100 mm/s",
        "target in tabletop and speed <= 100 mm/s and target not in camera_mast",
    ),
    ("move", "speed <= 1 m/s", "speed <= 0.25 m/s and target in tabletop and target not in camera_mast"),
]


@pytest.mark.parametrize(("kind", "envelope", "expected"), CASES)
def test_the_line_that_is_offered_is_proved_when_it_is_written(
    judge: Judge, kind: str, envelope: str, expected: str
) -> None:
    line = repair(judge, kind, envelope)
    assert line == expected
    again = judge(kind, line)
    assert again.conclusion is Conclusion.PROVED, [one.headline for one in again.diagnostics]
    assert not repairs(again)


def is_least(judge: Judge, kind: str, line: str, bound: str, step: str, *, upper: bool = True) -> bool:
    """Check that the line is proved, and no longer with `bound` one step laxer."""
    laxer = Decimal(bound) + (Decimal(step) if upper else -Decimal(step))
    assert line.count(bound) == 1
    return (
        judge(kind, line).conclusion is Conclusion.PROVED
        and judge(kind, line.replace(bound, str(laxer))).conclusion is Conclusion.REJECTED
    )


@pytest.mark.parametrize(
    ("kind", "envelope", "bound", "step"),
    [
        ("wait", "duration <= 0.5 h", "0.0083", "0.0001"),
        ("wait", "duration <= 40 s", "30", "0.000001"),
        ("turn", "angle < 1.7 rad and angle > -1 rad", "1.5707", "0.0001"),
        ("carry", "gait <= 101 mm/s", "100", "0.000001"),
    ],
)
def test_a_repair_that_is_off_by_one_step_is_noticed(
    judge: Judge, kind: str, envelope: str, bound: str, step: str
) -> None:
    line = repair(judge, kind, envelope)
    assert is_least(judge, kind, line, bound, step)
    for off in (Decimal(step), -Decimal(step)):
        twin = line.replace(bound, str(Decimal(bound) + off))
        assert not is_least(judge, kind, twin, str(Decimal(bound) + off), step)


def test_a_search_that_is_off_by_one_step_offers_nothing(
    judge: Judge, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An edit's claim is not trusted: the obligations are discharged again."""
    offered = repair(judge, "wait", "duration <= 31 s")
    honest = aeros.spec.verification.repairs.edits.ConditionEditor.strengthen

    def lax(*arguments: object) -> str | None:
        found = honest(*arguments)  # type: ignore[arg-type]
        return None if found is None else found.replace("30 s", "30.001 s")

    monkeypatch.setattr(aeros.spec.verification.repairs.edits.ConditionEditor, "strengthen", lax)
    assert offered == "duration <= 30 s"
    assert not repairs(judge("wait", "duration <= 31 s"))


def test_a_lower_bound_is_raised(judge: Judge) -> None:
    permission = "duration >= 7 s"
    assert (
        repair(judge, "wait", "5 s <= duration <= 20 s", permission=permission) == "7 s <= duration <= 20 s"
    )
    assert repair(judge, "wait", "duration < 20 s and duration > 5 s", permission="2 * duration > 14 s") == (
        "duration < 20 s and duration > 7 s"
    )


def test_one_line_repairs_all_faults_of_an_envelope(judge: Judge) -> None:
    report = judge("wait", "duration <= 31 s", permission="duration >= 2 s")
    mended = [str(one.obligation.id) for one in report.findings if one.repair]
    assert mended == ["permission/tidy/wait", "safety/tidy/wait/short-waits"]
    assert repairs(report) == {"wait: duration <= 30 s and duration >= 2 s"}


def test_a_fault_beyond_repair_does_not_prevent_other_repairs(judge: Judge) -> None:
    report = judge("approach", "pace <= 200 mm/s", permission="table_tidy")
    mended = [str(one.obligation.id) for one in report.findings if one.repair]
    assert mended == ["safety/tidy/approach/slow-near-person"]
    assert repairs(report) == {"approach: pace <= 200 mm/s and (person_near implies pace <= slow)"}


def test_no_line_is_offered_that_allows_nothing(judge: Judge) -> None:
    assert not repairs(judge("wait", "duration > 40 s"))  # nothing of it is allowed
    assert not repairs(judge("wait", "duration >= 31 s and duration <= 40 s"))
    assert not repairs(judge("wait", "duration <= 40 s", permission="duration > 30 s"))


def test_no_repair_is_offered_for_a_runtime_checked_rule(judge: Judge) -> None:
    assert not repairs(judge("approach", "pace <= 200 mm/s", gated="slow-near-person"))


def test_the_line_is_quoted_as_the_author_did_or_as_yaml_needs(judge: Judge) -> None:
    assert repairs(judge("wait", '"duration <= 31 s"')) == {'wait: "duration <= 30 s"'}
    assert repairs(judge("wait", "'duration <= 31 s'")) == {"wait: 'duration <= 30 s'"}
    folded = ">-\n        duration <= 31 s\n        and inputs.pause < 5 s"
    assert repairs(judge("wait", folded)) == {"wait: duration <= 30 s and inputs.pause < 5 s"}
    assert repairs(judge("wipe", "pressure <= 1 N", permission='"tool in {sponge, brush}"')) == {
        'wipe: "pressure <= 1 N and tool in {sponge, brush}"'
    }


def test_the_help_is_the_line(judge: Judge) -> None:
    (found,) = judge("wait", "duration <= 31 s").diagnostics
    assert found.help[0] == "write `wait: duration <= 30 s`"


def test_nothing_is_offered_where_the_budget_runs_out(judge: Judge, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aeros.spec.verification.repairs.edits, "MAX_QUERIES", 2)
    assert not repairs(judge("carry", "gait <= 101 mm/s"))


def test_a_repair_does_not_depend_on_earlier_queries(judge: Judge) -> None:
    def message() -> list[object]:
        report = judge("carry", "gait <= 137 mm/s and gait > 1 mm/s", permission="gait < 120 mm/s")
        return [report.diagnostics, [one.repair for one in report.findings]]

    first = message()
    solver = z3.Solver()
    x, y = z3.Reals("gait load")
    solver.add(x * y > 3, x + y < 10)
    assert solver.check() == z3.sat
    judge("turn", "abs(angle) <= 2 rad")
    assert message() == first


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("0", "0"),
        ("30", "30"),
        ("-1/4", "-0.25"),
        ("1/3", None),
        ("1/1000000000000", "0.000000000001"),
        ("100", "100"),
    ],
)
def test_decimals_are_exact_or_none(value: str, shown: str | None) -> None:
    assert exact_decimal(Fraction(value)) == shown


def test_a_reduced_budget_shares_the_answers_of_the_oracle() -> None:
    oracle = Oracle(rlimit=1000)
    assert oracle.with_reduced_budget(10).rlimit == 100
    assert oracle.with_reduced_budget(5000).rlimit == 1
