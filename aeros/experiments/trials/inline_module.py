"""Modules whose files are in a condition, as text: in a folder of their own, proved or not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from aeros.experiments.inputs import Premises
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove
from aeros.spec.text.discovery import reference_site


def written(files: Mapping[str, str], folder: Path) -> Path:
    """The new `folder`, with these files in it."""
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def proved(folder: Path, premises: Premises) -> Configuration:
    """The module alone, proved under the site of `premises`; raises `UserError` where it is refused."""
    site = premises.where.site
    return prove([folder], reference_site() if site is None else Path(site), certified=False)[0]
