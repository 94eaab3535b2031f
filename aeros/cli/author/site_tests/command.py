"""`aeros test`: compare decisions and verdicts under a site with those that files of tests expect."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.cli.arguments import add_command, existing_path
from aeros.cli.author.site_tests.cases import CaseResult
from aeros.cli.author.site_tests.judge import judge_cases
from aeros.cli.author.site_tests.output import as_json, as_junit, as_text
from aeros.cli.author.site_tests.read import CaseReader, asks_for_decisions, parse_site_tests
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, UsageError
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.gate.port import Gate
from aeros.runtime.proving import prove_configuration
from aeros.spec.backends.answer_store import open_default_store
from aeros.spec.declared.testing.site_tests import SiteTests
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, SpanLabel
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.fields import TextField
from aeros.spec.text.files import read_source
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import Detail, verify

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
A file names a site, modules, and tests.  A test of a decision gives a request and the measured state, and
expects ALLOW, ATTENUATE or DENY, perhaps by named rules.  A test of a verdict names a module, and expects
proved, rejected or undecided, perhaps with the codes of its errors.  `aeros schema tests` prints the schema.

  schema: aeros/tests/1
  description: people near the gripper
  modules: [ecms/make_dumplings]
  state: {estop_pressed: false, human_distance: 3 m}
  tests:
    grip_beside_a_person:
      skill: make_dumplings.wrap
      action: grip
      parameters: {width: 40 mm, force: 8 N}
      state: {human_distance: 0.3 m}
      expect: DENY
      by: [separation]

The exit code is 0 if all tests pass, and 1 if one fails or a file has a problem.

examples:
  aeros test tests/*.yaml                   every file; failures with their lines
  aeros test cell.yaml --verbose            also the tests that pass
  aeros test cell.yaml --only 'grip_*'      the tests whose names match
  aeros test cell.yaml --site new_cell.yaml under another site than the file names
  aeros test cell.yaml --format junit       for CI
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "test", __doc__, _EXAMPLES)
    parser.add_argument("files", nargs="+", type=existing_path, metavar="FILE", help="a file of tests")
    parser.add_argument("--site", type=existing_path, help="a site file in place of that of the tests")
    parser.add_argument("--only", metavar="PATTERN", default="*", help="run the tests with such names")
    parser.add_argument("--format", choices=("text", "json", "junit"), default="text", help="default: text")
    parser.add_argument("--verbose", action="store_true", help="also list the tests that pass")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if (folder := next((path for path in arguments.files if path.is_dir()), None)) is not None:
        raise UsageError(
            f"`{folder}` is a folder: name a YAML file of expected decisions, as `aeros new project` writes "
            "one; pytest runs a module's tests in Python"
        )
    declared = [(path, parse_site_tests(read_source(path))) for path in arguments.files]
    chosen = [(path, _choose(tests, arguments.only)) for path, tests in declared]
    if not any(count for _, (_, count) in chosen):
        raise UsageError(f"no test has a name like `{arguments.only}`")
    results = [(path, _judge(path, tests, arguments.site)) for path, (tests, count) in chosen if count]
    match arguments.format:
        case "json":
            print_data(as_json(results))
        case "junit":
            print_data(as_junit(results))
        case _:
            print(as_text(results, is_verbose=arguments.verbose))
    is_passed = all(one.is_passed for _, cases in results for one in cases)
    return Exit.SUCCESS if is_passed else Exit.REJECTED


def _choose(tests: SiteTests, pattern: str) -> tuple[SiteTests, int]:
    """Keep the tests whose names match a pattern; return them and their number."""
    kept = tuple((name, test) for name, test in tests.tests if fnmatchcase(name.value, pattern))
    return replace(tests, tests=replace(tests.tests, items=kept)), len(kept)


def _judge(path: Path, tests: SiteTests, other_site: Path | None) -> list[CaseResult]:
    """Resolve and judge the tests of one file.

    Raises:
        UserError: the file, its site or its modules have problems; it lists all of them.
    """
    site_path = other_site or _site_path(path.parent, tests.site)
    diagnostics = Diagnostics()
    modules = list(_module_paths(path.parent, tests.modules, diagnostics))
    diagnostics.raise_if_errors()
    site: Site | None
    known: Mapping[str, Ecm] = {}
    gate: Gate | None = None
    if asks_for_decisions(tests):
        configuration, _ = prove_configuration(modules, site_path, certified=False)
        site, known = configuration.site, configuration.modules
        gate = CompiledGate(configuration, GateMode.COMPILED)
    else:
        site = load_site(site_path, diagnostics)
    if site is None or diagnostics.has_errors:
        raise UserError(diagnostics)
    cases = CaseReader(tests, path.parent, site, known, diagnostics).cases()
    diagnostics.raise_if_errors()
    return list(judge_cases(cases, gate, partial(_verify, site_path)))


def _verify(site: Path, module: Path) -> Report:
    with open_default_store() as store:
        return verify([module], site, store=store, detail=Detail.BRIEF)


def _site_path(folder: Path, site: TextField | None) -> Path:
    """Return the site file that a file of tests names, relative to its folder.

    Raises:
        UserError: there is no such file.
    """
    if site is None:
        return reference_site_path()
    path = folder / site.value
    if not path.is_file():
        raise UserError([Diagnostic("AE002", f"`{path}` is no file", SpanLabel(site.span))])
    return path


def _module_paths(folder: Path, modules: Iterable[TextField], diagnostics: Diagnostics) -> Iterable[Path]:
    for module in modules:
        path = folder / module.value
        if path.exists():
            yield path
        else:
            diagnostics.error("AE130", f"`{path}` does not exist", module.span)
