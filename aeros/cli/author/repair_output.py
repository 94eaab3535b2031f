"""Proved repairs of `aeros verify`: printed as a diff (`--diff`) or written into the manifests (`--fix`).

Repairs of the site are printed and never written: the file is the operator's.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from aeros.cli.author.proved_repairs import (
    RepairedManifest,
    Verify,
    errors_without_repair,
    find_proved_repairs,
    find_site_repairs,
)
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, exit_for
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.verification.reports import Report


def print_repairs(report: Report, verify: Verify) -> Exit:
    """Print a diff of all proved repairs to standard output, and a summary to standard error.

    Args:
        report: Report on the modules as they are.
        verify: Verifies the modules in given folders.

    Returns:
        The exit code: REJECTED if there is a repair, else that of the report.
    """
    repaired = find_proved_repairs(report, verify)
    for one in repaired:
        print_data(one.unified_diff(), end="")
    site = find_site_repairs(report)
    if site is not None:
        print_data(site.unified_diff(), end="")
    summary = "\n".join([_summary("would repair", report, repaired), *_about_site("above", site)])
    print(summary, file=sys.stderr)
    return Exit.REJECTED if site is not None else exit_for(report.conclusion)


def write_repairs(report: Report, verify: Verify) -> tuple[str, bool]:
    """Write all proved repairs into the manifests.

    Args:
        report: Report on the modules as they are.
        verify: Verifies the modules in given folders.

    Returns:
        A summary for people, and True if a file was changed.
    """
    repaired, failures = [], []
    for one in find_proved_repairs(report, verify):
        try:
            one.write()
            repaired.append(one)
        except OSError as error:
            failures.append(f"cannot write `{escape_invisible(str(one.path))}`: {error.strerror}")
    about_site = _about_site("`--diff` shows it", find_site_repairs(report))
    return "\n".join([_summary("repaired", report, repaired), *failures, *about_site]), bool(repaired)


def _about_site(place: str, site: RepairedManifest | None) -> list[str]:
    """Say that the site has a repair, which is the operator's to write."""
    if site is None:
        return []
    return [
        f"{_count(site.repaired, 'warning')} of the site with a proved repair, for its operator ({place}):",
        *map(_line, site.repaired),
    ]


def _summary(verb: str, report: Report, repaired: Sequence[RepairedManifest]) -> str:
    """Count the repaired errors and the others, and list both with their places."""
    done = [found for one in repaired for found in one.repaired]
    left = errors_without_repair(report, repaired)
    lines = [f"{verb} {_count(done)} in {_count(repaired, 'file')}"]
    lines += map(_line, done)
    if left:
        lines += [f"{_count(left)} without a proved repair:", *map(_line, left)]
    return "\n".join(lines)


def _count(found: Sequence[object], noun: str = "error") -> str:
    return f"{len(found)} {noun if len(found) == 1 else f'{noun}s'}"


def _line(found: Diagnostic) -> str:
    place = "" if found.primary is None else f"{escape_invisible(str(found.primary.span))}: "
    return f"  {place}{found.code} {escape_invisible(found.headline)}"
