"""`aeros new site`, `new ci` and `new project`: files around modules, from templates."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Final

import aeros
from aeros import distribution
from aeros.cli.arguments import add_command, existing_folder, existing_path
from aeros.cli.author.new.naming import identifier, runtime_range
from aeros.cli.project_settings import find_settings
from aeros.cli.terminal.streams import print_line
from aeros.exit_codes import Exit
from aeros.files import replace_durably
from aeros.spec.verification.certificate import write_lock
from aeros.spec.verification.verify import verify

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_SITE_EXAMPLES = """\
The site is small and complete: actions, measured state, rules, and what modules are allowed.

examples:
  aeros new site cell                         cell.yaml, here
  aeros site cell.yaml                        lists what it declares
"""

_CI_EXAMPLES = """\
Without options it verifies what `aeros.toml` names, or else the modules in this folder, under the reference
site.

examples:
  aeros new ci                                .github/workflows/aeros.yaml and .pre-commit-config.yaml, here
  aeros new ci --modules ecms --site cell.yaml --tests cell_tests.yaml
"""

_PROJECT_EXAMPLES = """\
The folder gets a site, a module, expected decisions, a workflow and options.  All of it passes at once.

examples:
  aeros new project cell && cd cell && aeros verify && aeros test cell_tests.yaml
"""

_WORKFLOW: Final = ".github/workflows/aeros.yaml"
_HOOK: Final = ".pre-commit-config.yaml"


def add_to(kinds: Subparsers) -> None:
    """Add the commands.

    Args:
        kinds: Subparsers of `aeros new`.
    """
    site = add_command(kinds, "site", "create the policy of a robot cell: a small site file", _SITE_EXAMPLES)
    site.add_argument("name", type=identifier, metavar="NAME", help="name of the site and of its file")
    _add_parent(site)
    site.set_defaults(command=_new_site)
    ci = add_command(kinds, "ci", "create a GitHub workflow and pre-commit hooks", _CI_EXAMPLES)
    _add_parent(ci)
    ci.add_argument(
        "--modules", type=existing_path, action="append", metavar="PATH", help="modules; may be repeated"
    )
    ci.add_argument("--site", type=existing_path, help="the site file (default: the reference site)")
    ci.add_argument(
        "--tests",
        type=existing_path,
        action="append",
        default=[],
        metavar="FILE",
        help="files of `aeros test`",
    )
    ci.set_defaults(command=_new_ci)
    whole = add_command(
        kinds, "project", "create a folder with a site, a module, tests and CI", _PROJECT_EXAMPLES
    )
    whole.add_argument("name", type=identifier, metavar="NAME", help="name of the folder and of the site")
    _add_parent(whole)
    whole.set_defaults(command=_new_project)


def _add_parent(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--parent", type=existing_folder, default=Path(), metavar="FOLDER", help="default: here"
    )


def _new_site(arguments: argparse.Namespace) -> Exit:
    path = f"{arguments.name}.yaml"
    shown = shlex.quote(str(arguments.parent / path))
    return _create(
        arguments.parent,
        {path: _filled("site.yaml", name=arguments.name)},
        (
            f"aeros verify --site {shown}",
            f"aeros site {shown}",
            "aeros new project NAME       a site of this kind, with a module that fits it, tests and CI",
        ),
    )


def _new_ci(arguments: argparse.Namespace) -> Exit:
    folder: Path = arguments.parent
    settings = find_settings(folder)
    modules = arguments.modules or ([] if "ecms" in settings.options else [folder])
    tests = [_relative(path, folder) for path in arguments.tests]
    is_given = arguments.site is not None and "site" not in arguments.from_settings
    site = _relative(arguments.site, folder) if is_given else None
    given = [_relative(path, folder) for path in modules]
    files = _ci_files(given, site, tests)
    return _create(folder, files, (f"git add {_WORKFLOW} {_HOOK}", "pre-commit install"))


def _new_project(arguments: argparse.Namespace) -> Exit:
    name: str = arguments.name
    tests = f"{name}_tests.yaml"
    files = {
        f"{name}.yaml": _filled("site.yaml", name=name),
        "modules/pick/ecm.yaml": _filled("ecm.yaml", runtime=runtime_range()),
        "modules/pick/skills.py": _filled("skills.py"),
        tests: _filled("tests.yaml", name=name),
        "aeros.toml": _filled("aeros.toml", name=name),
        "README.md": _filled("README.md", name=name, repository=distribution.repository()),
        ".gitignore": ".aeros/\nruns/\n",
        **_ci_files([], None, [tests]),
    }
    steps = (
        f"cd {shlex.quote(str(arguments.parent / name))}",
        "aeros verify",
        f"aeros test {tests}",
        'aeros run "pick up the part"',
    )
    code = _create(arguments.parent, {f"{name}/{path}": text for path, text in files.items()}, steps)
    if code is Exit.SUCCESS:
        _prove(arguments.parent / name / "modules", arguments.parent / name / f"{name}.yaml")
    return code


def _prove(modules: Path, site: Path) -> None:
    """Write the certificates of new modules, so that the checks in CI pass from the first commit on."""
    for module in verify([modules], site).modules:
        if module.lock is not None:
            write_lock(module.path, module.lock.certificate)


def _ci_files(modules: Sequence[str], site: str | None, tests: Sequence[str]) -> dict[str, str]:
    """Return workflow and hooks by path; without modules and site, those of `aeros.toml` are verified."""
    repository, revision = distribution.repository(), f"v{aeros.__version__}"
    words = [*map(shlex.quote, modules), *([] if site is None else ["--site", shlex.quote(site)])]
    hook = ", ".join(["--check", *modules, *([] if site is None else ["--site", site])])
    formatted = [*modules, *([] if site is None else [site]), *tests] if modules else ["."]
    steps = "".join(f"      - run: aeros test {shlex.quote(one)}\n" for one in tests)
    workflow = _filled(
        "workflow.yaml",
        requirement=f"{distribution.NAME} @ git+{repository}@{revision}",
        format_command=" ".join(["aeros fmt", *map(shlex.quote, formatted), "--check"]),
        command=" ".join(["aeros verify", *words, "--check --format github"]),
        test_steps=steps,
    )
    return {
        _WORKFLOW: workflow,
        _HOOK: _filled(
            "pre-commit.yaml",
            repository=repository,
            revision=revision,
            formatted=", ".join(formatted),
            arguments=hook,
        ),
    }


def _relative(path: Path, folder: Path) -> str:
    return os.path.relpath(path.resolve(), folder.resolve())


def _filled(template: str, **given: str) -> str:
    """Fill a template in."""
    folder = resources.files("aeros") / "templates" / "project"
    text = (folder / f"{template}.template").read_text(encoding="utf-8")
    return Template(text).substitute(given)


def _create(folder: Path, files: Mapping[str, str], steps: Sequence[str]) -> Exit:
    """Write files that must not exist, and print what to do next; write none if one exists."""
    present = [folder / path for path in files if os.path.lexists(folder / path)]
    if present:
        print(
            f"aeros: `{present[0]}` exists already; choose another name, or another folder with --parent",
            file=sys.stderr,
        )
        return Exit.REJECTED
    try:
        for path, text in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            replace_durably(folder / path, text.encode(), is_private=False)
    except OSError as error:
        print(f"aeros: cannot write to `{folder}`: {error.strerror}", file=sys.stderr)
        return Exit.REJECTED
    for path in files:
        print_line(str(folder / path))
    if "/OWNER/" in distribution.repository() and any(".github" in path for path in files):
        print(f"\n{distribution.repository()} is a placeholder: put the repository of AEROS in its place")
    print("\nnext:")
    for step in steps:
        print_line(f"  {step}")
    return Exit.SUCCESS
