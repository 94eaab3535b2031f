"""`aeros new ecm`: create a module from a template, one that is proved and runs unchanged."""

from __future__ import annotations

import argparse
import json
import os
import re
import shlex
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Final

from aeros.cli.arguments import add_command, existing_folder, existing_path
from aeros.cli.author.new.naming import MOST_CHARACTERS, identifier, runtime_range
from aeros.exit_codes import Exit
from aeros.files import temporary_folder
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import MANIFEST, reference_site_path

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
The module picks up a block.  Its folder holds the manifest ecm.yaml, the code skills.py and perceivers.py,
and a scene for simulation.  Its tests are in test_NAME.py next to the folder.
Continue with docs/tutorial.md.

examples:
  aeros new ecm tidy                          the folder tidy/ and test_tidy.py, here
  aeros new ecm tidy --parent ecms            in a folder of modules
  aeros new ecm tidy --instruction "pick up"  then: aeros run "pick up" --ecms tidy --plant symbolic
  aeros new ecm tidy --site cell.yaml         for a site of your own
"""

_WORDS: Final = re.compile(r"[^\W_][\w-]*( [\w-]+)*")
"""Trigger phrases: words with single blanks between them."""

_SCENE: Final = "scenes/table.yaml"
"""Path of the scene file in the module's folder."""


class _NewModuleError(Exception):
    """A module that is not created; the message says why and what to do."""


def add_to(kinds: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        kinds: Subparsers of `aeros new`.
    """
    parser = add_command(kinds, "ecm", "create a capability module with tests", _EXAMPLES)
    parser.add_argument("name", type=identifier, metavar="NAME", help="name of the module and of its folder")
    parser.add_argument(
        "--parent", type=existing_folder, default=Path(), metavar="FOLDER", help="default: here"
    )
    parser.add_argument(
        "--site",
        type=existing_path,
        help="the site file for which it is (default: the reference site, a Panda cell)",
    )
    parser.add_argument(
        "--instruction",
        type=_task,
        metavar="WORDS",
        help="the instruction that starts its task (default: NAME)",
    )
    parser.set_defaults(command=_command)


def _task(text: str) -> str:
    if not _WORDS.fullmatch(text) or len(text) > MOST_CHARACTERS:
        raise argparse.ArgumentTypeError(
            f"`{escape_invisible(text)}` cannot ask for a task: write words of letters, digits, `-` and `_`, "
            f'one blank between them and at most {MOST_CHARACTERS} characters, as in "pick up"'
        )
    return text


def _command(arguments: argparse.Namespace) -> Exit:
    name, place, words = arguments.name, arguments.parent, arguments.instruction or arguments.name
    sink = Diagnostics()
    site = load_site(arguments.site or reference_site_path(), sink)
    sink.raise_if_errors()
    if site is None:
        return Exit.REJECTED
    try:
        _check_name(name, site)
        for path in (place / name, place / f"test_{name}.py"):
            _check_absent(path)
        unbound = _write_module(name, place, _files(name, words, place, arguments.site), site)
    except OSError as error:
        print(
            f"aeros: cannot write to `{place}`: {error.strerror}; choose another with --parent",
            file=sys.stderr,
        )
        return Exit.REJECTED
    except _NewModuleError as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    print(_next_steps(name, words, place, arguments.site, unbound))
    return Exit.SUCCESS


def _check_name(name: str, site: Site) -> None:
    """Reject a name that the site's policy mentions: a new module must not inherit another's grants.

    Raises:
        _NewModuleError: The policy mentions the name.
    """
    if name in site.grants or any(block.module == name for block in site.blocks):
        raise _NewModuleError(
            f"the policy of `{site.id}` already speaks of a module `{name}`; choose another name"
        )


def _check_absent(path: Path) -> None:
    if os.path.lexists(path):
        raise _NewModuleError(
            f"`{path}` exists already; choose another name, or another folder with --parent"
        )


def _files(name: str, words: str, place: Path, site: Path | None) -> dict[str, str]:
    """The text of each file by its path in `place`."""
    given = {
        "name": name,
        "words": words,
        "runtime": runtime_range(),
        "gated": "arm-separation" if site is None else "any",
        "site_arguments": ""
        if site is None
        else f', "--site", str(HERE / {json.dumps(_relative_path(place, site))})',
    }
    names = {
        MANIFEST: f"{name}/{MANIFEST}",
        "skills.py": f"{name}/skills.py",
        "perceivers.py": f"{name}/perceivers.py",
        "scene.yaml": f"{name}/{_SCENE}",
        "test.py": f"test_{name}.py",
    }
    templates = resources.files("aeros") / "templates" / "ecm"
    return {
        path: Template((templates / f"{template}.template").read_text(encoding="utf-8")).substitute(given)
        for template, path in names.items()
    }


def _relative_path(place: Path, site: Path) -> str:
    """Return the path from the folder `place` to the file `site`."""
    return os.path.relpath(site.resolve(), place.resolve())


def _write_module(name: str, place: Path, files: dict[str, str], site: Site) -> list[Diagnostic]:
    """Write `files` into `place`, all or none, if they fit `site`; return the problems of open needs."""
    with temporary_folder(place) as staged:
        for path, text in files.items():
            (staged / path).parent.mkdir(parents=True, exist_ok=True)
            (staged / path).write_text(text, encoding="utf-8")
        unbound = _unbound_needs(staged / name, site)
        (staged / name).rename(place / name)
        (staged / f"test_{name}.py").rename(place / f"test_{name}.py")
    return unbound


def _unbound_needs(folder: Path, site: Site) -> list[Diagnostic]:
    """Return the diagnostics of needs that the author has to bind, or to change in the new module.

    Raises:
        _NewModuleError: The module does not fit the site in another way.
    """
    sink = Diagnostics()
    load_ecm(folder, site, sink)
    lacking = dict.fromkeys(escape_invisible(problem.headline) for problem in sink if problem.code != "AE136")
    if lacking:
        raise _NewModuleError(
            f"the template does not fit `{site.id}`:\n" + "\n".join(f"  {headline}" for headline in lacking)
        )
    return list(sink)


def _next_steps(name: str, words: str, place: Path, site: Path | None, unbound: Sequence[Diagnostic]) -> str:
    module = shlex.quote(str(place / name))
    under = "" if site is None else f" --site {shlex.quote(str(site))}"
    return "\n".join(
        (
            f"{place / name / MANIFEST}: what it may do",
            f"{place / name / 'skills.py'}: how it does it",
            f"{place / name / 'perceivers.py'}: how it sees",
            f"{place / name / _SCENE}: what stands about in simulation",
            f"{place / f'test_{name}.py'}: its tests",
            "",
            *_binding_steps(name, unbound),
            "next:",
            f"  aeros verify {module}{under}",
            f"  aeros run {shlex.quote(words)} --ecms {module} --plant symbolic{under}",
        )
    )


def _binding_steps(name: str, unbound: Sequence[Diagnostic]) -> list[str]:
    """Say which needs are open, and how to bind or change them."""
    if not unbound:
        return []
    return [
        "this site leaves needs of the template open:",
        *(f"  {escape_invisible(problem.headline)}" for problem in unbound),
        f"bind each in the site file or an overlay, as in `modules: {{{name}: {{bind: {{NEED: THING}}}}}}`,",
        f"or on the command line, as in `--bind {name}.NEED=THING`; or change the need in {MANIFEST}",
        "",
    ]
