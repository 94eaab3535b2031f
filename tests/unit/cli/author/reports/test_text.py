"""The report for a terminal: problems, a line for each subject, boundaries, and the second solver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.cli.author.reports.result import VerifyResult
from aeros.cli.author.reports.text import TextDetail, as_text
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Conclusion, Verdict
from aeros.spec.verification.claim_summary import Claims, ClaimSummary
from aeros.spec.verification.reports import Report, SubjectReport
from aeros.spec.verification.second_opinion.cross_check import SecondSolverReport
from tests.unit.cli.author.reports.results import result_of

SITE = SubjectReport("bench", Path("site.yaml"), Conclusion.PROVED, ())
MODULE = SubjectReport("handling", Path("handling"), Conclusion.REJECTED, (Diagnostic("AE101", "wrong"),))


def shown(
    *modules: SubjectReport,
    agreement: SecondSolverReport | None = None,
    detail: TextDetail = TextDetail.USUAL,
) -> list[str]:
    return as_text(VerifyResult(Report(SITE, modules, None, None, agreement)), detail=detail).splitlines()


def test_problems_come_first_and_then_a_line_for_each_subject() -> None:
    assert shown(MODULE) == [
        "error[AE101] unknown-field: wrong",
        "",
        "bench     proved        0 obligations",
        "handling  rejected      0 obligations",
    ]


def test_a_subject_without_a_name_has_no_line() -> None:
    nameless = replace(MODULE, name="", diagnostics=())
    assert shown(nameless) == ["bench  proved        0 obligations"]


def test_rules_that_the_gate_decides_are_named_with_their_modules() -> None:
    lines = as_text(result_of("accepted")).splitlines()
    assert lines[-4:] == [
        "",
        "2 rules are checked at run time, before each action (-v shows the conditions)",
        "  left_to_the_gate, gate_named_without_need: stop-button",
        "  left_to_the_gate: slow-near-person",
    ]
    (summary,) = [line for line in lines if line.startswith("left_to_the_gate ")]
    assert summary.endswith(" obligations, 2 runtime-checked")


def test_rules_of_many_modules_are_listed_by_those_that_have_them() -> None:
    def module(name: str, *rules: str) -> SubjectReport:
        claims = [
            ClaimSummary(ClaimForm.ENVELOPE_OBEYS("wipe", "grip", rule), Verdict.REFUTED, rule, "speed > 0")
            for rule in rules
        ]
        return SubjectReport(name, Path(name), Conclusion.PROVED, (), Claims.from_claims(tuple(claims)))

    modules = [module(name, "stop", "slow") for name in "abcd"]
    few = [*modules, module("e", "stop"), module("f", "stop"), module("g")]
    assert shown(*few)[-3:] == [
        "2 rules are checked at run time, before each action (-v shows the conditions)",
        "  all 6 modules: stop",
        "  all but e, f: slow",
    ]
    others = [module(name, "stop") for name in "efgh"]
    assert shown(*modules, *others)[-2:] == ["  all 8 modules: stop", "  4 of 8 modules: slow"]


def test_conditions_are_shown_on_demand_and_broken_at_the_width_of_the_terminal() -> None:
    lines = as_text(result_of("accepted"), detail=TextDetail.VERBOSE).splitlines()
    assert lines[-4:] == [
        "",
        "the gate allows while",
        "  stop-button       not stop_pressed",
        "  slow-near-person  not person_near or pace <= 0.1 m/s",
    ]
    narrow = as_text(result_of("accepted"), detail=TextDetail.VERBOSE, width=45).splitlines()
    assert narrow[-2:] == ["  slow-near-person  not person_near or pace", "                    <= 0.1 m/s"]


def test_a_quiet_report_tells_problems_alone() -> None:
    quiet = VerifyResult(Report(SITE, (MODULE,), None))
    assert as_text(quiet, detail=TextDetail.QUIET) == "error[AE101] unknown-field: wrong\n"
    assert "obligations" not in as_text(result_of("accepted"), detail=TextDetail.QUIET)


def test_outcomes_without_which_tasks_are_proved_are_listed() -> None:
    left_out = replace(MODULE, diagnostics=(), left_out=("look.gone", "look.\x1b"))
    proved = replace(left_out, conclusion=Conclusion.PROVED)
    counted = "tasks are proved without 2 outcomes of probability 0 (-v lists them)"
    assert shown(proved)[-2:] == ["", counted]
    assert "without 1 outcome of probability 0 (-v lists it)" in shown(replace(proved, left_out=("a.b",)))[-1]
    assert shown(proved, detail=TextDetail.VERBOSE)[-3:] == [
        "",
        "tasks are proved without these outcomes, of probability 0",
        "  handling:  look.gone, look.\\x1b",
    ]
    assert "probability 0" not in "".join(shown(left_out))


def test_a_module_that_is_not_proved_has_no_boundaries() -> None:
    result = result_of("accepted")
    report = result.report
    rejected = tuple(replace(one, conclusion=Conclusion.REJECTED) for one in report.modules)
    together = report.configuration
    without = replace(
        report,
        modules=rejected,
        configuration=None if together is None else replace(together, conclusion=Conclusion.REJECTED),
        site=replace(report.site, conclusion=Conclusion.REJECTED),
    )
    for detail in TextDetail:
        text = as_text(VerifyResult(without), detail=detail)
        assert "the gate allows while" not in text
        assert "checked" not in text


@pytest.mark.parametrize(
    ("undecided", "lines"),
    [
        ((), ["", "cvc5 agreed on 3 of 3 questions"]),
        (
            (("safety/x", "out of time"), ("y\x1b", "why")),
            [
                "",
                "cvc5 agreed on 3 of 5 questions; 2 undecided by it (Z3's verdict used):",
                "  safety/x: out of time",
                "  y\\x1b: why",
            ],
        ),
    ],
)
def test_a_second_solver_says_how_far_it_agreed(
    undecided: tuple[tuple[str, str], ...], lines: list[str]
) -> None:
    agreement = SecondSolverReport("cvc5", 3 + len(undecided), undecided)
    assert shown(agreement=agreement)[1:] == lines


def test_colours_are_only_where_they_are_asked_for() -> None:
    result = VerifyResult(Report(SITE, (MODULE,), None))
    assert "\x1b[" not in as_text(result)
    assert "\x1b[" in as_text(result, paint=lambda text, role: f"\x1b[1m{text}\x1b[0m")


def test_a_name_that_could_mislead_a_terminal_is_escaped() -> None:
    lines = shown(replace(MODULE, name="x\x1b[2J", diagnostics=()))
    assert lines == ["bench     proved        0 obligations", "x\\x1b[2J  rejected      0 obligations"]
