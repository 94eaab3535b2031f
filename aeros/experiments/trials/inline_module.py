"""Modules whose files are in a condition, as text: in a folder of their own, proved or not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from aeros.experiments.inputs import TrialInputs
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration
from aeros.spec.text.discovery import reference_site_path


def write_module_files(files: Mapping[str, str], folder: Path) -> Path:
    """The new `folder`, with these files in it."""
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def prove_module(folder: Path, premises: TrialInputs) -> Configuration:
    """The module alone, proved under the site of `premises`; raises `UserError` where it is refused."""
    site = premises.paths.site
    return prove_configuration(
        [folder], reference_site_path() if site is None else Path(site), certified=False
    )[0]
