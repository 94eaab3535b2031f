"""Result of a run of `aeros verify`: the report, and problems of certificates."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.verification.reports import Report, SubjectReport


@dataclass(frozen=True)
class LocatedDiagnostic:
    """A diagnostic and the file that it concerns.

    Attributes:
        diagnostic: The diagnostic.
        path: The file; None if it concerns no file.
    """

    diagnostic: Diagnostic
    path: Path | None


@dataclass(frozen=True)
class VerifyResult:
    """Input of all renderers.

    Attributes:
        report: The report of the verification.
        certificates: Problems of certificates, with the files.
    """

    report: Report
    certificates: tuple[LocatedDiagnostic, ...] = ()

    @property
    def subjects(self) -> tuple[SubjectReport, ...]:
        """The site, the modules, and the configuration if there are several modules."""
        return self.report.subjects

    @property
    def problems(self) -> Iterator[LocatedDiagnostic]:
        """All diagnostics of the run in the order of subjects; those of certificates last."""
        site, modules = self.report.site, self.report.modules
        yield from (LocatedDiagnostic(found, site.path) for found in site.diagnostics)
        for module in modules:
            path = module.path / MANIFEST if module.name else None
            yield from (LocatedDiagnostic(found, path) for found in module.diagnostics)
        together = self.report.configuration
        if together is not None:
            yield from (LocatedDiagnostic(found, None) for found in together.diagnostics)
        yield from self.certificates


def message_text(diagnostic: Diagnostic) -> str:
    """Write a diagnostic without its source lines, for formats that show these themselves.

    Args:
        diagnostic: The diagnostic.

    Returns:
        The headline, then a paragraph for each note and each help; invisible characters are escaped.
    """
    notes = (f"note: {text}" for text in diagnostic.notes)
    helps = (f"help: {text}" for text in diagnostic.help)
    text = "\n".join((diagnostic.headline, *notes, *helps))
    return "\n".join(escape_invisible(line) for line in text.split("\n"))


def path_below_working_folder(path: Path) -> Path:
    """Shorten the path of a file; in CI the working folder is the root of the repository.

    Args:
        path: Path of a file.

    Returns:
        The path relative to the working folder for a file below it, else the absolute path.
    """
    full = Path(os.path.abspath(path))
    return full.relative_to(Path.cwd()) if full.is_relative_to(Path.cwd()) else full
