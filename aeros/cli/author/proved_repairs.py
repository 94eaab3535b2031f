"""Repaired manifests: applies the repairs that a report holds, and keeps those that are proved as a whole.

Each repair is proved by itself before a report holds it.  Here all repairs of a run are applied to a copy of
the modules, and the copy is verified.  A manifest is kept if its repaired errors are gone and no error is
new.  A repair that becomes possible by another one is found in the next round.
"""

from __future__ import annotations

import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from aeros.cli.file_changes import replace_text, unified_diff
from aeros.files import make_folder, temporary_folder
from aeros.spec.diagnostics.codes import Diagnostic, Fix, Severity
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.text.files import read_source
from aeros.spec.verification.repairs.quota_repair import repair_quotas
from aeros.spec.verification.reports import Report, SubjectReport

_MAX_ROUNDS: Final = 8

Verify = Callable[[Sequence[Path]], Report]
"""Verifies the modules in given folders."""


@dataclass(frozen=True)
class RepairedManifest:
    """A manifest with its proved repairs.

    Attributes:
        path: path of the manifest.
        before: its text.
        after: the repaired text.
        repaired: errors of the old text that the new one does not have.
    """

    path: Path
    before: str
    after: str
    repaired: tuple[Diagnostic, ...]

    def unified_diff(self) -> str:
        """Return the repairs as a unified diff.

        Returns:
            Text that `patch -p0` and `git apply -p0` read.
        """
        return unified_diff(self.before, self.after, escape_invisible(str(self.path)))

    def write(self) -> None:
        """Replace the manifest by the repaired text; its mode stays, and so does a link to it.

        Raises:
            OSError: the file cannot be written, or was changed since it was verified.
        """
        replace_text(self.path, self.before, self.after)


def find_proved_repairs(report: Report, verify: Verify) -> tuple[RepairedManifest, ...]:
    """Find the manifests that repairs mend, and prove the result.

    Args:
        report: Report on the modules as they are.
        verify: Verifies the modules in given folders, as they were for the report.

    Returns:
        The repaired manifests, in the order of the report; nothing is written.
    """
    modules = {one.path: one for one in report.modules if one.name}
    original = {folder: read_source(folder / MANIFEST).text for folder in modules if _fixes(modules[folder])}
    texts, known, refused = dict(original), dict(modules), set[Path]()
    for _ in range(_MAX_ROUNDS):
        edited = {
            folder: _apply_fixes(texts[folder], _fixes(known[folder]))
            for folder in texts
            if folder not in refused and _fixes(known[folder])
        }
        if not edited:
            break
        found = _verify_copies(list(modules), texts | edited, verify)
        refused_now = {folder for folder in edited if not _is_mended(known[folder], found[folder])}
        if not refused_now and any(_new_errors(known[folder], found[folder]) for folder in modules):
            refused_now |= edited.keys()  # any of them may be the reason of an error in another module
        if refused_now:
            refused |= refused_now
            continue
        texts |= edited
        known = found
    repaired = (
        RepairedManifest(
            folder / MANIFEST, original[folder], text, _mended_errors(modules[folder], known[folder])
        )
        for folder, text in texts.items()
        if text != original[folder]
    )
    return tuple(repaired)


def find_site_repairs(report: Report) -> RepairedManifest | None:
    """Find the proved repairs of the site file; it is the operator's, so they are shown and not written.

    Args:
        report: Report on the site and its modules as they are.

    Returns:
        The repaired site file; None if nothing of it has a repair.
    """
    repairable = tuple(found for found in report.site.diagnostics if found.fix is not None)
    sources = {found.fix.span.source for found in repairable if found.fix is not None}
    if not sources:
        return None
    source = sources.pop()
    return RepairedManifest(report.site.path, source.text, repair_quotas(source), repairable)


def errors_without_repair(report: Report, repaired: Iterable[RepairedManifest]) -> list[Diagnostic]:
    """List the errors that stay.

    Args:
        report: Report on the modules as they are.
        repaired: Manifests that are repaired.

    Returns:
        The errors in the order of the report.
    """
    repaired_errors = Counter(found for one in repaired for found in one.repaired)
    left = []
    for found in (found for subject in report.subjects for found in _errors(subject)):
        if repaired_errors[found]:
            repaired_errors[found] -= 1
        else:
            left.append(found)
    return left


def _errors(subject: SubjectReport) -> list[Diagnostic]:
    return [found for found in subject.diagnostics if found.severity is Severity.ERROR]


def _identity(found: Diagnostic) -> tuple[str, str]:
    return found.code, found.headline


def _new_errors(before: SubjectReport, after: SubjectReport) -> Counter[tuple[str, str]]:
    return Counter(map(_identity, _errors(after))) - Counter(map(_identity, _errors(before)))


def _mended_errors(before: SubjectReport, after: SubjectReport) -> tuple[Diagnostic, ...]:
    left = Counter(map(_identity, _errors(after)))
    mended = []
    for found in _errors(before):
        if left[_identity(found)]:
            left[_identity(found)] -= 1
        else:
            mended.append(found)
    return tuple(mended)


def _is_mended(before: SubjectReport, after: SubjectReport) -> bool:
    """Tell if every error with a repair is gone, and none is new."""
    left = Counter(map(_identity, _errors(after)))
    fixed = Counter(_identity(found) for found in _errors(before) if found.fix is not None)
    others = Counter(map(_identity, _errors(before))) - fixed
    return not left - others and not _new_errors(before, after)


def _fixes(module: SubjectReport) -> list[Fix]:
    """Return the repairs of a module's manifest, each once."""
    found = [one.fix for one in _errors(module) if one.fix is not None]
    return list(dict.fromkeys(fix for fix in found if Path(fix.span.source.path).name == MANIFEST))


def _apply_fixes(text: str, fixes: Sequence[Fix]) -> str:
    """Apply repairs from the last to the first; of two that overlap, the first one given."""
    chosen: list[Fix] = []
    for fix in fixes:
        apart = all(fix.span.end <= one.span.start or one.span.end <= fix.span.start for one in chosen)
        if apart and fix.span.source.text == text:
            chosen.append(fix)
    for fix in sorted(chosen, key=lambda one: one.span.start, reverse=True):
        text = text[: fix.span.start] + fix.text + text[fix.span.end :]
    return text


def _verify_copies(
    folders: Sequence[Path], texts: Mapping[Path, str], verify: Verify
) -> dict[Path, SubjectReport]:
    """Verify modules with other manifests, in a copy that keeps each among its neighbours."""
    with temporary_folder() as root:
        copies = {folder: _copy_of(folder, root) for folder in folders}
        for folder in folders:
            _copy_neighbours(folder, copies[folder].parent)
            if folder in texts:
                _copy_module(folder, copies[folder], texts[folder])
        found = {one.path: one for one in verify(list(copies.values())).modules}
    return {folder: found[copy] for folder, copy in copies.items()}


def _copy_of(folder: Path, root: Path) -> Path:
    """Return the path of a copy; modules of one folder have their copies in one folder."""
    full = folder.resolve()
    return root / full.parent.relative_to(full.anchor) / full.name


def _copy_neighbours(folder: Path, place: Path) -> None:
    """Link the modules next to one, unless that was done for one of them."""
    make_folder(place)
    for neighbour in sorted(folder.resolve().parent.iterdir()):
        link = place / neighbour.name
        if (neighbour / MANIFEST).is_file() and not os.path.lexists(link):
            link.symlink_to(neighbour, target_is_directory=True)


def _copy_module(folder: Path, copy: Path, manifest: str) -> None:
    if copy.is_symlink():
        copy.unlink()
        shutil.copytree(folder, copy, symlinks=True)
    target = copy / MANIFEST
    target.unlink()
    target.write_bytes(manifest.encode())
