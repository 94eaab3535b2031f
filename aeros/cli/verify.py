"""`aeros verify`: proves modules under a site's policy and writes their certificates."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from aeros.cli.arguments import existing_path
from aeros.cli.exit_codes import EXIT_CODES, Exit, exit_for
from aeros.spec.backends.budget import DEFAULT_RLIMIT
from aeros.spec.certificate import LOCK, check_lock
from aeros.spec.diagnostics import Diagnostic, Severity
from aeros.spec.loading import reference_site
from aeros.spec.render import render_json, render_text, safe
from aeros.spec.verify import Conclusion, Report, SubjectReport, verify

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
examples:
  aeros verify ecms/                          every module below, under the reference site
  aeros verify my_module --site cell.yaml     one module under another site
  aeros verify ecms/ --format json            for programs
  aeros verify ecms/ --check                  write nothing; fail if a certificate is missing or stale
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments."""
    parser = commands.add_parser(
        "verify",
        help="prove modules safe under a site's policy",
        description=__doc__,
        epilog=f"{_EXAMPLES}\n{EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "paths", nargs="+", type=existing_path, metavar="PATH", help="a module, or a folder of modules"
    )
    parser.add_argument(
        "--site", type=existing_path, help="the site file (default: the reference site, a Panda cell)"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument(
        "--check", action="store_true", help=f"do not write {LOCK}, but require it to be current"
    )
    parser.add_argument("--no-lock", action="store_true", help=f"neither write nor require {LOCK}")
    parser.add_argument(
        "--rlimit",
        type=_positive,
        default=DEFAULT_RLIMIT,
        help="the solver's budget for one question, in z3 resource units (default: %(default)s)",
    )
    parser.set_defaults(command=_command)


def _positive(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) < 2**32:
        raise argparse.ArgumentTypeError("expected a whole number between 1 and 4294967295")
    return int(text)


def _command(arguments: argparse.Namespace) -> Exit:
    progress = _progress if sys.stderr.isatty() else lambda _: None
    report = verify(arguments.paths, arguments.site or reference_site(), arguments.rlimit, progress)
    locks = [] if arguments.no_lock else _locks(report, write=not arguments.check)
    if arguments.format == "json":
        print(json.dumps(_as_json(report, locks), indent=1, ensure_ascii=True))
    else:
        print(_as_text(report, locks))
    stale = any(problem.severity is Severity.ERROR for problem in locks)
    if report.conclusion is Conclusion.PROVED and stale:
        return Exit.REJECTED
    return exit_for(report.conclusion)


def _progress(name: str) -> None:
    print(f"\r\x1b[Kproving {safe(name)} …", end="\r", file=sys.stderr, flush=True)


def _locks(report: Report, *, write: bool) -> list[Diagnostic]:
    """Write or check the certificate of each proved module; what is wrong with any of them.

    That of a rejected module stays as it is: it is stale now, so nothing runs on the strength of it.
    """
    problems: list[Diagnostic] = []
    for module in report.modules:
        lock = module.path / LOCK
        try:
            if module.certificate is None:
                continue
            if not write:
                problem = check_lock(module.path, module.certificate)
                problems += [problem] if problem is not None else []
            elif not lock.exists() or lock.read_bytes() != module.certificate.text().encode():
                lock.write_text(module.certificate.text(), encoding="utf-8")
        except OSError as error:
            problems.append(
                Diagnostic(
                    "AE904",
                    f"cannot write `{lock}`: {error.strerror}",
                    help=("make the folder writable, or use `--no-lock`",),
                    severity=Severity.WARNING,
                )
            )
    return problems


def _as_text(report: Report, locks: list[Diagnostic]) -> str:
    subjects = (report.site, *report.modules)
    problems = [problem for subject in subjects for problem in subject.diagnostics] + locks
    parts = [render_text(problem, colour=sys.stdout.isatty()) for problem in problems]
    width = max(len(safe(subject.name)) for subject in subjects)
    lines = [_summary(subject, width) for subject in subjects if subject.name]
    return "\n".join([*(part.rstrip("\n") + "\n" for part in parts), *lines])


def _summary(subject: SubjectReport, width: int) -> str:
    name, conclusion = safe(subject.name), subject.conclusion.value
    line = f"{name:{width}}  {conclusion:9}  {subject.obligation_count:4} obligations"
    if subject.conclusion is Conclusion.PROVED and subject.guarded:
        rules = dict.fromkeys(finding.obligation.guard for finding in subject.guarded)
        line += f", {len(subject.guarded)} guarded: the gate decides {', '.join(map(str, rules))}"
    return line


def _as_json(report: Report, locks: list[Diagnostic]) -> dict[str, Any]:
    return {
        "schema": "aeros/report/1",
        "conclusion": report.conclusion.value,
        "site": _subject_json(report.site),
        "modules": [_subject_json(module) for module in report.modules],
        "certificates": [render_json(problem) for problem in locks],
    }


def _subject_json(subject: SubjectReport) -> dict[str, Any]:
    verdicts: list[dict[str, Any]] = [
        {"id": one.id, "verdict": one.verdict.value, "guarded": False} for one in subject.settled
    ]
    for finding in subject.findings:
        verdict: dict[str, Any] = {
            "id": finding.obligation.id,
            "verdict": finding.verdict.value,
            "guarded": finding.guarded,
        }
        if finding.witness is not None:
            verdict["witness"] = finding.witness.lines()
        verdicts.append(verdict)
    return {
        "name": subject.name,
        "path": str(subject.path),
        "conclusion": subject.conclusion.value,
        "obligations": verdicts,
        "diagnostics": [render_json(problem) for problem in subject.diagnostics],
    }
