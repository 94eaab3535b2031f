"""Results of real runs over the corpus, which the tests of every format share."""

from __future__ import annotations

import contextlib
from functools import cache
from pathlib import Path

from aeros.cli.author.reports.result import LocatedDiagnostic, VerifyResult
from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT
from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.certificate import check_lock
from aeros.spec.verification.reports import Report, SubjectReport
from aeros.spec.verification.verify import verify

CORPUS = Path(__file__).parents[4] / "corpus"

RUNS = {
    "accepted": ["accepted/left_to_the_gate", "accepted/gate_named_without_need"],
    "rejected": ["rejected/safety/fast_near_a_person", "rejected/dependencies/three_in_a_circle"],
    "vacuous": ["rejected/safety/envelope_that_holds_nothing", "rejected/permission/permission_for_nothing"],
    "undecided": ["accepted/left_to_the_gate"],
    "second solver": ["accepted/distance_within_a_cube"],
    "unreadable": ["rejected/form/bytes_that_are_not_utf8", "rejected/form/null_character_in_the_file"],
    "no module": ["site/table.yaml"],
    "many modules": [
        *[str(path.parent.relative_to(CORPUS)) for path in sorted(CORPUS.glob("accepted/*/ecm.yaml"))[::10]],
        *("rejected/form", "rejected/expressions", "rejected/permission", "rejected/safety"),
        "rejected/dependencies",
    ],
}


@cache
def result_of(run: str) -> VerifyResult:
    """The result of one of the RUNS, with certificates required and missing."""
    with contextlib.chdir(CORPUS):
        rlimit = DEFAULT_RLIMIT
        if run == "undecided":
            rlimit = 1
        second = Cvc5(rlimit=50_000) if run == "second solver" else None
        report = verify(map(Path, RUNS[run]), Path("site/table.yaml"), rlimit, second=second)
        locks = [
            LocatedDiagnostic(problem, module.path / "ecm.lock")
            for module in report.modules
            if module.certificate is not None
            and (problem := check_lock(module.path, module.certificate)) is not None
        ]
    return VerifyResult(report, tuple(locks))


def result_with(*diagnostics: Diagnostic, name: str = "module", path: Path = Path("module")) -> VerifyResult:
    """A result made up of one module with these diagnostics under a site with none."""
    site = SubjectReport("site", Path("site.yaml"), Conclusion.PROVED, ())
    module = SubjectReport(name, path, Conclusion.REJECTED, diagnostics)
    return VerifyResult(Report(site, (module,), None))


def diagnostic_at(
    text: str,
    marked: str,
    *,
    headline: str = "wrong",
    severity: Severity = Severity.ERROR,
    path: str = "a.yaml",
) -> Diagnostic:
    """A diagnostic that underlines the first `marked` in `text`."""
    start = text.index(marked)
    span = Source(path, text).span(start, start + len(marked))
    return Diagnostic("AE101", headline, SpanLabel(span, "here"), severity=severity)
