"""Arguments that name a module, and a task or composition in it."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeVar

from aeros.cli.arguments import add_module_folders, existing_path
from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import (
    Surroundings,
    all_module_folders,
    module_folders,
    reference_site_path,
)
from aeros.spec.verification.modules_with_settings import absent_module_problems

_T = TypeVar("_T")


def add_module(parser: argparse.ArgumentParser) -> None:
    """Add the argument that names a module, and the option for modules that it requires.

    Args:
        parser: Parser of a command.
    """
    parser.add_argument("module", type=existing_path, metavar="MODULE", help="the module's folder")
    add_module_folders(parser, "modules that it requires (default: those next to it)")


def read_module(
    path: Path,
    required: Iterable[Path],
    site_path: Path | None,
    configurations: Mapping[str, ModuleConfiguration],
) -> tuple[Ecm, Site]:
    """Read a module under a site.

    Args:
        path: The module's folder.
        required: Modules, or folders of modules, among which it finds those that it requires, before those
            next to it.
        site_path: The site file; None for the reference site.
        configurations: Settings by module.

    Returns:
        The module, and the site with the module's own state variables.

    Raises:
        UserError: A file is rejected; lists all problems.
        UsageError: The folder holds several modules.
    """
    sink = Diagnostics()
    site = load_site(site_path or reference_site_path(), sink)
    if site is not None:
        site = site.with_configurations(configurations)
    folders = [] if site is None else module_folders(path, sink)
    around = Surroundings(named=tuple(all_module_folders(required, sink)))
    loaded = load_ecm(folders[0], site, sink, around) if site is not None and len(folders) == 1 else None
    for problem in absent_module_problems(configurations, [*folders, *around.named]):
        sink.report(problem)
    sink.raise_if_errors()
    if loaded is None or site is None:
        raise UsageError(f"`{path}` holds several modules; name one")
    return loaded.ecm, site.with_modules(loaded.ecm.with_owners)


def select_declared(ecm: Ecm, what: str, declared: Mapping[str, _T], name: str | None) -> _T:
    """Select a task or composition by name.

    Args:
        ecm: The module, for messages.
        what: `task` or `composition`, for messages.
        declared: The module's tasks or compositions by name.
        name: The name; None for the first.

    Returns:
        The selected task or composition.

    Raises:
        UsageError: There is none of that name, or none at all.
    """
    wanted = next(iter(declared), None) if name is None else name
    if wanted is None:
        raise UsageError(f"`{ecm.id}` has no {what}")
    if wanted not in declared:
        near = did_you_mean(wanted, declared)
        hint = f"did you mean `{near}`?" if near else f"it has {', '.join(declared) or 'none'}"
        raise UsageError(f"`{ecm.id}` has no {what} `{escape_invisible(wanted)}`; {hint}")
    return declared[wanted]
