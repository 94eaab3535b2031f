"""Modules whose files are in a condition, as text: each in a folder of its own, proved or not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from aeros.experiments.inputs import TrialInputs
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration
from aeros.spec.text.discovery import reference_site_path


def write_module_files(files: Mapping[str, str], folder: Path) -> Path:
    """Write the files of a module into a new folder.

    Args:
        files: texts by name of the file.
        folder: does not exist yet.

    Returns:
        The folder.
    """
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def prove_module(folder: Path, premises: TrialInputs) -> Configuration:
    """Prove a module alone.

    Args:
        folder: of the module.
        premises: have the site to prove it under.

    Returns:
        The configuration of this one module.

    Raises:
        UserError: the module is refused.
    """
    site = premises.paths.site
    return prove_configuration(
        [folder], reference_site_path() if site is None else Path(site), certified=False
    )[0]
