"""`aeros fmt`: write manifests, sites, scenes and other files of AEROS in one layout, with their comments."""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.cli.arguments import add_command, existing_path
from aeros.cli.file_changes import is_pinned, replace_text, unified_diff
from aeros.cli.terminal.rendering import print_diagnostics
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, UsageError
from aeros.files import open_regular
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.diagnostics.source import Source
from aeros.spec.migrations import formats
from aeros.spec.migrations.rewriting import format_of
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.text.files import MAX_BYTES, decode_source, read_source
from aeros.spec.text.layout import LayoutRefusedError, format_yaml

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES: Final = """\
A file says its format in `schema`, as in `schema: aeros/ecm/2`.  Folders are searched recursively; other
YAML files, links, hidden folders and a robot's registry are skipped.  Only spaces and line breaks change.

examples:
  aeros fmt ecms/ cell.yaml           write manifests and a site in the one layout
  aeros fmt ecms/ --check             write nothing; exit with 1 if a file has another layout
  aeros fmt ecms/ --diff              the same, and show what would change
  aeros fmt - < cell.yaml             from standard input to standard output, as editors ask for it
"""

_STANDARD_INPUT: Final = Path("-")
_SUFFIXES: Final = (".yaml", ".yml")
_REGISTRY: Final = formats.REGISTRY.files[0]
_SCHEMA: Final = re.compile(rb"schema[\"']?\s*:\s*[\"']?aeros/")
_SKIPPED: Final = frozenset({"__pycache__", "node_modules"})
_CERTIFIED: Final = frozenset({"ecm", "site", "overlay"})
_NO_FORMAT: Final = (
    "no format of a YAML file that AEROS knows; the first line says it, as in `schema: aeros/site/1`"
)
_PINNED: Final = (
    "the registry keeps it under its digest; "
    "format the original, and install the module or put the policy in force again"
)


class _ForeignFileError(Exception):
    """File that is of no YAML format of AEROS."""

    def __str__(self) -> str:
        return "it is of no YAML format that AEROS knows; a file says its own as in `schema: aeros/site/1`"


_PROBLEMS: Final = (UserError, LayoutRefusedError, InternalError, OSError, _ForeignFileError)


@dataclass(frozen=True, slots=True)
class _FormattedFile:
    """A file and its layout.

    Attributes:
        path: the file; `-` for standard input.
        before: its text.
        after: its text in the one layout.
        format: name of its format, such as `ecm`.
    """

    path: Path
    before: str
    after: str
    format: str

    @property
    def is_changed(self) -> bool:
        """True if the layout differs."""
        return self.before != self.after


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "fmt", __doc__, _EXAMPLES)
    parser.add_argument(
        "paths",
        nargs="+",
        type=_path_or_standard_input,
        metavar="PATH",
        help="a file, a folder, or - for standard input",
    )
    dry = parser.add_mutually_exclusive_group()
    dry.add_argument(
        "--check", action="store_true", help="write nothing; exit with 1 if a file has another layout"
    )
    dry.add_argument("--diff", action="store_true", help="the same, and show what would change")
    parser.add_argument("-q", "--quiet", action="store_true", help="print problems and diffs alone")
    parser.set_defaults(command=_command)


def _path_or_standard_input(text: str) -> Path:
    return _STANDARD_INPUT if text == "-" else existing_path(text)


def _command(arguments: argparse.Namespace) -> Exit:
    if _STANDARD_INPUT not in arguments.paths:
        return _format_files(arguments)
    if len(arguments.paths) > 1:
        raise UsageError("`-` is standard input and stands alone: leave out the other paths")
    return _format_standard_input(arguments)


def _format_files(arguments: argparse.Namespace) -> Exit:
    """Format every file, also after one with a problem."""
    is_dry = arguments.check or arguments.diff
    done: list[_FormattedFile] = []
    codes: list[Exit] = []
    seen: set[Path] = set()
    for path in arguments.paths:
        is_empty = True
        for file in _files_below(path) if path.is_dir() else [path]:
            try:
                is_new = file.resolve() not in seen
                seen.add(file.resolve())
                found = _format_file(file, is_named=file == path, is_dry=is_dry) if is_new else None
                is_empty = is_empty and is_new and found is None
            except _PROBLEMS as error:
                is_empty = False
                codes.append(_print_problem(str(file), error))
                continue
            if found is not None:
                done.append(found)
                _print_change(found, arguments)
        if is_empty:
            print(f"aeros: there is no YAML file of AEROS in or below `{_shown(path)}`", file=sys.stderr)
            codes.append(Exit.REJECTED)
    changed = [one for one in done if one.is_changed]
    if not arguments.quiet:
        _print_summary(changed, len(done), arguments)
    if changed and is_dry:
        codes.append(Exit.REJECTED)
    return max(codes, default=Exit.SUCCESS)


def _files_below(folder: Path) -> Iterator[Path]:
    """Yield the YAML files in and below a folder, in a fixed order."""
    for here, folders, names in os.walk(folder):
        if _REGISTRY in names:  # its modules and policies are copies under their digests
            folders.clear()
            continue
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in _SKIPPED)
        for name in sorted(names):
            path = Path(here, name)
            if path.suffix in _SUFFIXES and path.is_file() and not path.is_symlink():
                yield path


def _format_file(path: Path, *, is_named: bool, is_dry: bool) -> _FormattedFile | None:
    """Format one file; None for a file in a folder that is none of AEROS.

    Raises:
        UserError: it cannot be read.
        LayoutRefusedError: its form has no layout.
        InternalError: the layout would change what it says.
        OSError: it cannot be written.
        _ForeignFileError: it is named and of no format of AEROS.
    """
    try:
        found = _formatted(path, read_source(path))
    except (UserError, _ForeignFileError) as error:
        if is_named or (isinstance(error, UserError) and _may_be_ours(path)):
            raise
        return None
    if not found.is_changed:
        return found
    if is_pinned(path):
        raise OSError(0, _PINNED)
    if not is_dry:
        replace_text(path, found.before, found.after)
    return found


def _may_be_ours(path: Path) -> bool:
    """Tell if a file that cannot be read as text may be of AEROS: if its bytes say so, or cannot be read."""
    try:
        with open_regular(path) as file:
            return path.name == MANIFEST or _SCHEMA.search(file.read(MAX_BYTES)) is not None
    except OSError:
        return True


def _formatted(path: Path, source: Source) -> _FormattedFile:
    """Lay out a text.

    Raises:
        UserError: it is no YAML that AEROS reads.
        LayoutRefusedError: its form has no layout.
        InternalError: the layout would change what it says.
        _ForeignFileError: it is of no format of AEROS.
    """
    name = path if path.suffix in _SUFFIXES else path.with_name(f"{path.name}.yaml")
    format_ = format_of(name, source.text)
    if format_ is None:
        raise _ForeignFileError
    return _FormattedFile(path, source.text, format_yaml(source), format_.name)


def _format_standard_input(arguments: argparse.Namespace) -> Exit:
    """Format standard input; with a problem, nothing is written to standard output."""
    try:
        source = decode_source("standard input", sys.stdin.buffer.read(MAX_BYTES + 1))
        found = _formatted(_STANDARD_INPUT, source)
    except _PROBLEMS as error:
        return _print_problem("standard input", error)
    if arguments.check or arguments.diff:
        _print_change(found, arguments)
        return Exit.REJECTED if found.is_changed else Exit.SUCCESS
    # The bytes themselves, as a terminal's encoding may lack some of the characters.
    sys.stdout.flush()
    sys.stdout.buffer.write(found.after.encode())
    return Exit.SUCCESS


def _print_problem(name: str, error: Exception) -> Exit:
    """Print why a file is left as it is, and return the exit code."""
    if isinstance(error, UserError):
        print_diagnostics(error.diagnostics)
        return Exit.REJECTED
    if isinstance(error, LayoutRefusedError):
        place, reason = str(error.span), error.reason
    else:
        place = name
        reason = str(error.strerror or error) if isinstance(error, OSError) else str(error)
    is_ours = isinstance(error, InternalError)
    cause = "a bug in aeros, please report it with the file: " if is_ours else ""
    print(
        f"aeros: {escape_invisible(place)}: left as it is: {cause}{escape_invisible(reason)}", file=sys.stderr
    )
    return Exit.INTERNAL_ERROR if is_ours else Exit.REJECTED


def _print_change(found: _FormattedFile, arguments: argparse.Namespace) -> None:
    if not found.is_changed:
        return
    if arguments.diff:
        for line in unified_diff(found.before, found.after, str(found.path)).split("\n")[:-1]:
            print_data(escape_invisible(line))
    elif arguments.check or not arguments.quiet:
        print(f"{'would format' if arguments.check else 'formatted'} {_shown(found.path)}")


def _print_summary(changed: Sequence[_FormattedFile], files: int, arguments: argparse.Namespace) -> None:
    is_dry = arguments.check or arguments.diff
    verb, others = ("to format", "formatted already") if is_dry else ("formatted", "unchanged")
    into = sys.stderr if arguments.diff else sys.stdout  # the diff alone is for `git apply`
    print(f"{counted(len(changed), 'file')} {verb}, {files - len(changed)} {others}", file=into)
    if not is_dry and any(one.format in _CERTIFIED for one in changed):
        print("Certificates hold the digests of manifest and site: run `aeros verify` again.")


def _shown(path: Path) -> str:
    return escape_invisible(str(path))
