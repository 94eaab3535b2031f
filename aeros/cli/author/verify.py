"""`aeros verify`: prove modules under a site's policy and write their certificates."""

from __future__ import annotations

import argparse
import gc
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from aeros.cli.arguments import (
    add_colour,
    add_command,
    add_solver_limits,
    add_verbosity,
    available_cpus,
    existing_path,
    process_count,
    second_solver,
    writable_path,
)
from aeros.cli.author.reports.result import LocatedDiagnostic, VerifyResult
from aeros.cli.author.reports.text import TextDetail, as_text
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.progress import ProgressLine
from aeros.cli.terminal.rendering import painter, print_diagnostics
from aeros.cli.terminal.streams import end_progress, output_width, print_coloured, print_data
from aeros.exit_codes import Exit, UsageError, exit_for
from aeros.spec.backends.answer_store import open_default_store
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.diagnostics.errors import DisagreementError, UserError
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import SCENES, reference_site_path
from aeros.spec.verification.certificate import LOCK, check_lock, write_lock
from aeros.spec.verification.reports import Progress, Report
from aeros.spec.verification.verify import Detail, verify

if TYPE_CHECKING:
    from aeros.spec.backends.solver_results import SecondSolver

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
examples:
  aeros verify ecms/                          every module below, under the reference site
  aeros verify my_module --site cell.yaml     one module under another site
  aeros verify --site cell.yaml               the site alone
  aeros verify clean_pot --bind clean_pot.surface=bench --set clean_pot.force="6 N"
                                              bound and set as given; the certificate names it
  aeros verify ecms/ --format json            for programs; `aeros schema report` prints its schema
  aeros verify ecms/ --format sarif --output verify.sarif
                                              text, and a file for code scanning
  aeros verify ecms/ --format github          annotations on the lines of a pull request
  aeros verify ecms/ --watch                  again whenever a file changes, while you edit
  aeros verify ecms/ --check                  write nothing; fail if a certificate is missing or stale
  aeros verify ecms/ --diff                   show proved repairs; `--fix` writes them
  aeros verify ecms/ --second-solver cvc5     check every obligation with cvc5 too
  aeros verify ecms/ --strict                 and how each question is written; exit 3 if cvc5 leaves one open
"""

_FORMATS: Final = ("text", "json", "sarif", "junit", "github")


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "verify", __doc__, _EXAMPLES)
    parser.add_argument(
        "paths",
        nargs="*",
        type=existing_path,
        metavar="PATH",
        help="a module, or a folder of modules (default: `ecms` of aeros.toml; with --site alone, none)",
    )
    parser.add_argument(
        "--site", type=existing_path, help="the site file (default: the reference site, a Panda cell)"
    )
    parser.add_argument("--format", choices=_FORMATS, default="text", help="default: text")
    parser.add_argument(
        "--output",
        type=writable_path,
        metavar="FILE",
        help="write the report of that format to FILE, and text to standard output",
    )
    parser.add_argument(
        "--check", action="store_true", help=f"do not write {LOCK}, but require it to be current"
    )
    parser.add_argument("--no-lock", action="store_true", help=f"neither write nor require {LOCK}")
    repairs = parser.add_mutually_exclusive_group()
    repairs.add_argument(
        "--fix", action="store_true", help="write proved repairs into the manifests, and verify them again"
    )
    repairs.add_argument(
        "--diff",
        action="store_true",
        help="print proved repairs as a diff, and write nothing; exit with 1 if there are any",
    )
    add_module_settings(parser)
    add_solver_limits(parser)
    parser.add_argument("--no-cache", action="store_true", help="do not use cached solver answers")
    parser.add_argument(
        "--jobs",
        type=process_count,
        metavar="N",
        help="number of processes that prove modules (default: one for each processor)",
    )
    parser.add_argument(
        "--second-solver",
        type=second_solver,
        metavar="cvc5",
        help="also check every obligation with cvc5; a disagreement exits with code 4",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="check every obligation with cvc5, and at points that each question is written for both solvers "
        "as the language defines it; exit with 3 if anything is left undecided",
    )
    add_colour(parser)
    parser.add_argument(
        "--watch", action="store_true", help="verify again whenever a file changes, until Ctrl-C"
    )
    add_verbosity(
        parser,
        quiet="print problems alone, and no progress",
        verbose="show the condition of each rule that is checked at run time, and outcomes left out",
    )
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    _require_consistent(arguments)
    if arguments.watch:
        _watch(arguments)
    return _verify_once(arguments)


def _watch(arguments: argparse.Namespace) -> NoReturn:
    """Verify again whenever a file changes, until Ctrl-C, or until nobody reads the output."""
    from aeros.cli.author import watch  # most runs do not need it

    def watched() -> Iterator[Path]:
        return watch.files_read_for(arguments.paths, arguments.site)

    known = watch.take_snapshot(watched())
    while True:
        try:
            _verify_once(arguments)
        except UserError as error:
            print_diagnostics(error.diagnostics)
        print(f"\nwatching {counted(len(known), 'file')}; Ctrl-C ends", flush=True)
        former, known = known, watch.wait_for_change(watched, known)
        first, *others = watch.changed_files(former, known)
        more = f" and {counted(len(others), 'other file')}" if others else ""
        print(f"\n{time.strftime('%H:%M:%S')}  {_relative(first)}{more} changed")


def _relative(path: Path) -> Path:
    """Shorten a path below the working directory."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def _verify_once(arguments: argparse.Namespace) -> Exit:
    try:
        report = _verify(arguments)
        if arguments.diff:
            from aeros.cli.author.repair_output import print_repairs  # most runs do not need it

            return print_repairs(report, lambda folders: _verify_briefly(arguments, folders))
        summary = ""
        if arguments.fix:
            from aeros.cli.author.repair_output import write_repairs

            summary, is_changed = write_repairs(report, lambda folders: _verify_briefly(arguments, folders))
            report = _verify(arguments) if is_changed else report
    except DisagreementError as error:
        print_coloured(_disagreement(error), sys.stderr)
        return Exit.INTERNAL_ERROR
    locks = [] if arguments.no_lock else _update_certificates(report, arguments)
    result = VerifyResult(_with_scene_warnings(report), tuple(locks))
    as_asked = _renderer(arguments.format)
    if arguments.output is not None and not _write_report(arguments.output, as_asked(result)):
        return Exit.USAGE
    in_text = arguments.output is not None or arguments.format == "text"
    if in_text:
        _print_text(result, arguments)
    else:
        print_data(as_asked(result))
    if summary:
        print(summary, file=sys.stdout if in_text else sys.stderr)
    stale = any(problem.diagnostic.severity is Severity.ERROR for problem in locks)
    if report.conclusion is Conclusion.PROVED and stale:
        return Exit.REJECTED
    if report.conclusion is Conclusion.PROVED and arguments.strict and not report.is_confirmed:
        return Exit.UNDECIDED
    return exit_for(report.conclusion)


def _with_scene_warnings(report: Report) -> Report:
    """Add warnings of scenes that a run could not load."""
    if not any(one.scenes or one.composed_scenes or (one.path / SCENES).is_dir() for one in report.modules):
        return report
    from aeros.cli.author.scene_checks import add_scene_warnings  # half of the time to start

    return add_scene_warnings(report)


def _require_consistent(arguments: argparse.Namespace) -> None:
    """Refuse options that contradict each other.

    Raises:
        UsageError: repairs are asked for with an option that excludes them.
    """
    if not arguments.paths and (arguments.site is None or "site" in arguments.from_settings):
        raise UsageError(
            "name a module or a folder of modules, or set `ecms` in aeros.toml; "
            "`--site FILE` alone proves a site without modules"
        )
    if arguments.watch and (arguments.format != "text" or arguments.output is not None):
        raise UsageError("--watch prints text, again and again: leave out --format and --output")
    if arguments.fix and arguments.check:
        raise UsageError("--fix writes repairs and --check writes nothing: give one of them")
    if arguments.diff and (arguments.format != "text" or arguments.output is not None):
        raise UsageError("--diff prints a diff and no report: leave out --format and --output")


def _second_solver(arguments: argparse.Namespace) -> SecondSolver | None:
    """Return the solver that was asked for, by name or by `--strict`.

    Raises:
        UsageError: cvc5 is not installed.
    """
    if arguments.second_solver is None and arguments.strict:
        try:
            return second_solver("cvc5")
        except argparse.ArgumentTypeError as error:
            raise UsageError(f"--strict asks cvc5, and {error}") from error
    solver: SecondSolver | None = arguments.second_solver
    return solver


def _verify_briefly(arguments: argparse.Namespace, folders: Sequence[Path]) -> Report:
    """Verify modules in other folders by Z3 alone."""
    options = {**vars(arguments), "paths": folders, "second_solver": None, "strict": False}
    return _verify(argparse.Namespace(**options))


def _verify(arguments: argparse.Namespace) -> Report:
    progress: Progress = (lambda _: None) if arguments.quiet else _shown_progress()
    second = _second_solver(arguments)
    # Proofs make almost no reference cycles: to look for them takes some hundredths of a run.
    with (
        _no_cycle_search(),
        nullcontext() if arguments.no_cache else open_default_store() as store,
        _ended_progress(),
    ):
        return verify(
            arguments.paths,
            arguments.site or reference_site_path(),
            arguments.rlimit,
            progress,
            store,
            second=second,
            detail=Detail.BRIEF if second is None else Detail.FULL,
            jobs=arguments.jobs or available_cpus(),
            seconds=arguments.question_timeout,
            settings=OperatorSettings(configurations=module_configurations(arguments)),
            strict=arguments.strict,
        )


@contextmanager
def _no_cycle_search() -> Iterator[None]:
    is_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_on:
            gc.enable()


@contextmanager
def _ended_progress() -> Iterator[None]:
    """Show no progress after the block, while `--watch` waits for a change."""
    try:
        yield
    finally:
        end_progress()


def _print_text(result: VerifyResult, arguments: argparse.Namespace) -> None:
    """Print the report in as much detail as asked for."""
    detail = TextDetail.VERBOSE if arguments.verbose else TextDetail.USUAL
    detail = TextDetail.QUIET if arguments.quiet else detail
    paint = painter(sys.stdout, arguments.color)
    text = as_text(result, paint=paint, detail=detail, width=output_width())
    if text:
        print_coloured(text)


def _renderer(name: str) -> Callable[[VerifyResult], str]:
    """Import the renderer of a format; most runs need none but text."""
    match name:
        case "json":
            from aeros.cli.author.reports.json_report import as_json

            return as_json
        case "sarif":
            from aeros.cli.author.reports.sarif import as_sarif

            return as_sarif
        case "junit":
            from aeros.cli.author.reports.junit import as_junit

            return as_junit
        case "github":
            from aeros.cli.author.reports.github import as_github

            return as_github
        case _:
            return as_text


def _disagreement(error: DisagreementError) -> str:
    """Describe a disagreement of the solvers, and save the query in a file for a bug report."""
    lines = [
        f"aeros: two answers about {escape_invisible(error.about)} differ:",
        *(f"  {escape_invisible(answer)}" for answer in error.answers),
        "One of the solvers or aeros is wrong; nothing was proved or written.",
    ]
    try:
        handle, name = tempfile.mkstemp(prefix="aeros-disagreement-", suffix=".smt2")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(error.script)
        lines.append(f"Please report it with the question, which is in {escape_invisible(name)}")
    except OSError as problem:
        lines.append(
            f"Please report it with the question, which could not be written to a file ({problem.strerror}):"
        )
        lines.append(error.script)
    return "\n".join(lines)


def _write_report(path: Path, text: str) -> bool:
    """Write a report; print the reason and return False if it cannot be written."""
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        print(f"aeros: cannot write `{escape_invisible(str(path))}`: {error.strerror}", file=sys.stderr)
        return False
    return True


def _shown_progress() -> Progress:
    line = ProgressLine()
    return lambda name: line.show(f"proving {escape_invisible(name)}")


def _update_certificates(report: Report, arguments: argparse.Namespace) -> list[LocatedDiagnostic]:
    """Write or check the certificate of each proved module, and return the problems.

    The certificate of a rejected module is kept.  It is stale now, so no agent loads the module.  Of a module
    that a link leads to, a certificate of the same files under another site is kept, too: whoever has the
    files needs it, and a run under this site proves the module anyway.
    """
    problems: list[LocatedDiagnostic] = []
    for module in report.modules:
        lock = module.path / LOCK
        try:
            if module.lock is None or module.lock.matches_folder(module.path):
                continue
            is_linked = module.path.is_symlink()
            if is_linked and not check_lock(module.path, module.lock.certificate, accepts_other_setup=True):
                continue
            if arguments.check:
                given = module_configurations(arguments)
                problem = check_lock(module.path, module.lock.certificate, arguments.site, given)
                problems += [LocatedDiagnostic(problem, lock)] if problem is not None else []
            else:
                write_lock(module.path, module.lock.certificate)
        except OSError as error:
            problem = Diagnostic(
                "AE904",
                f"cannot write `{lock}`: {error.strerror}",
                help=("make the folder writable, or use `--no-lock`",),
                severity=Severity.WARNING,
            )
            problems.append(LocatedDiagnostic(problem, lock))
    return problems
