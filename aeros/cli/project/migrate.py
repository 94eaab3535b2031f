"""`aeros migrate`: rewrite files of older AEROS versions in the current format, with comments and layout."""

from __future__ import annotations

import argparse
import json
import os
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.errors import AgentError
from aeros.agent.identity import undisturbed
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.file_changes import is_pinned, replace_text, unified_diff
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.migrations.format import UnmigratableError
from aeros.spec.migrations.rewriting import Rewritten, format_of, has_known_name, rewrite

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/migration/1"

_EXAMPLES: Final = """\
A file says its format and version in `schema`, as in `schema: aeros/ecm/2`.  Folders are
searched recursively for files of known formats; other files, links and hidden folders are skipped.
Databases are migrated when they are opened.  docs/formats.md lists formats and their versions.

examples:
  aeros migrate ecms/ cell.yaml       rewrite manifests and a site file
  aeros migrate .aeros                the files of a state folder, while no agent runs
  aeros migrate ecms/ --diff          show what would change, and write nothing
  aeros migrate ecms/ --check         write nothing; exit with 1 if a file has an older version
  aeros migrate ecms/ --format json   for programs
"""
_PINNED: Final = (
    "it is old, and the registry keeps it under its digest; "
    "migrate the original, and install the module or put the policy in force again"
)
_MOST_BYTES: Final = 1 << 30
_CERTIFIED: Final = ("ecm", "site")
_SKIPPED: Final = frozenset({"__pycache__", "node_modules"})


@dataclass(frozen=True, slots=True)
class _File:
    """Result of one file: `rewritten` from the text `before`, or the problem."""

    path: Path
    rewritten: Rewritten | None
    problem: str = ""
    before: str = ""

    @property
    def state(self) -> str:
        """`current`, `old` or `refused`."""
        if self.rewritten is None:
            return "refused"
        return "old" if self.rewritten.is_changed else "current"


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "migrate", __doc__, _EXAMPLES)
    parser.add_argument("paths", nargs="+", type=existing_path, metavar="PATH", help="a file, or a folder")
    parser.add_argument(
        "--check", action="store_true", help="write nothing; exit with 1 if a file has an older version"
    )
    parser.add_argument("--diff", action="store_true", help="write nothing; show what would change")
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    is_dry = arguments.check or arguments.diff
    done = []
    for path, is_named in _candidates(arguments.paths):
        found = _migrated(path, is_named=is_named, is_dry=is_dry)
        if found is not None:
            done.append((found, _diff(found) if arguments.diff else ""))
    if arguments.format == "json":
        print_data(json.dumps(_as_json(done, is_dry=is_dry), indent=1))
    else:
        _print_text(done, is_dry=is_dry)
    states = {found.state for found, _ in done}
    if "refused" in states or (arguments.check and "old" in states):
        return Exit.REJECTED
    return Exit.SUCCESS


def _candidates(paths: Iterable[Path]) -> Iterator[tuple[Path, bool]]:
    """Yield each file once, with whether it was named; of folders the files with known names."""
    seen: set[Path] = set()
    for path in paths:
        for one in [path] if not path.is_dir() else _below(path):
            if one.resolve() not in seen:
                seen.add(one.resolve())
                yield one, one == path


def _below(folder: Path) -> Iterator[Path]:
    for root, folders, names in os.walk(folder):
        folders[:] = sorted(one for one in folders if not one.startswith(".") and one not in _SKIPPED)
        for name in sorted(names):
            path = Path(root, name)
            if has_known_name(path) and path.is_file() and not path.is_symlink():
                yield path


def _migrated(path: Path, *, is_named: bool, is_dry: bool) -> _File | None:
    """Migrate one file; None for a file in a folder that has no AEROS format."""
    guard = nullcontext() if is_dry else undisturbed(path.parent)
    try:
        with guard:
            content = _read(path)
            text = content.decode("utf-8")
            mark = "\ufeff" if text.startswith("\ufeff") else ""
            text = text.removeprefix(mark)
            format_ = format_of(path, text)
            if format_ is None:
                return _File(path, None, "it is of no format that AEROS migrates") if is_named else None
            rewritten = rewrite(path, text, format_)
            if rewritten.is_changed and is_pinned(path):
                return _File(path, None, _PINNED)
            if rewritten.is_changed and not is_dry:
                replace_text(path, mark + text, mark + rewritten.text)
            return _File(path, rewritten, before=text)
    except UnicodeDecodeError:
        return _File(path, None, "it is not UTF-8 text") if is_named else None
    except (UnmigratableError, AgentError) as error:
        return _File(path, None, str(error))
    except UserError as error:
        return _File(path, None, "; ".join(_error_lines(error)))
    except OSError as error:
        return _File(path, None, str(error.strerror or error))


def _read(path: Path) -> bytes:
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(0, "it is not a regular file")
    with path.open("rb") as file:
        content = file.read(_MOST_BYTES + 1)
    if len(content) > _MOST_BYTES:
        raise OSError(0, "it is too large")
    return content


def _error_lines(error: UserError) -> Iterator[str]:
    for one in error.diagnostics:
        yield f"{one.code}: {one.headline}" + (f" ({one.primary.span})" if one.primary is not None else "")


def _diff(found: _File) -> str:
    if found.rewritten is None or not found.rewritten.is_changed:
        return ""
    return unified_diff(found.before, found.rewritten.text, str(found.path), f"{found.path} (migrated)")


def _print_text(done: list[tuple[_File, str]], *, is_dry: bool) -> None:
    for found, diff in done:
        if found.rewritten is None:
            print(
                f"{escape_invisible(str(found.path))}: refused: {escape_invisible(found.problem)}",
                file=sys.stderr,
            )
            continue
        format_ = found.rewritten.format
        if found.state == "old":
            was, is_ = format_.schema_of(found.rewritten.version), format_.schema
            print(
                f"{escape_invisible(str(found.path))}: {'is old' if is_dry else 'migrated'}: {was} -> {is_}"
            )
            print("".join(f"  {change}\n" for change in found.rewritten.changes), end="")
        if diff:
            print_data("".join(f"{escape_invisible(line)}\n" for line in diff.splitlines()), end="")
    counts = {
        state: sum(found.state == state for found, _ in done) for state in ("old", "current", "refused")
    }
    verb = "to migrate" if is_dry else "migrated"
    print(f"{counts['old']} {verb}, {counts['current']} current, {counts['refused']} refused")
    if not is_dry and any(
        found.state == "old" and found.rewritten is not None and found.rewritten.format.name in _CERTIFIED
        for found, _ in done
    ):
        print("Certificates hold the digests of manifest and site: run `aeros verify` again.")


def _as_json(done: list[tuple[_File, str]], *, is_dry: bool) -> dict[str, Any]:
    files = []
    for found, diff in done:
        entry: dict[str, Any] = {"path": str(found.path), "state": found.state}
        if found.rewritten is None:
            entry["problem"] = found.problem
        else:
            one = found.rewritten
            entry |= {"format": one.format.name, "from": one.version, "to": one.format.version}
            entry |= {"changes": list(one.changes)}
        files.append(entry | ({"diff": diff} if diff else {}))
    return {"schema": SCHEMA, "written": not is_dry, "files": files}
