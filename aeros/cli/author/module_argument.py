"""The one module that a command is asked about, and what is named in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.model import Ecm, Site
from aeros.spec.text.discovery import module_folders, reference_site_path

_T = TypeVar("_T")


def read_module(path: Path, site_path: Path | None) -> tuple[Ecm, Site]:
    """The module at `path` under a site, the reference site where none is given.

    Raises `UserError` with everything that stands in its way, `UsageError` where there are several.
    """
    sink = Diagnostics()
    site = load_site(site_path or reference_site_path(), sink)
    folders = [] if site is None else module_folders(path, sink)
    loaded = load_ecm(folders[0], site, sink) if site is not None and len(folders) == 1 else None
    sink.raise_if_errors()
    if loaded is None or site is None:
        raise UsageError(f"`{path}` holds several modules; name one")
    return loaded.ecm, site


def select_declared(ecm: Ecm, what: str, declared: Mapping[str, _T], name: str | None) -> _T:
    """The task or composition of that name, the first where none is given; `what` says which it is.

    Raises `UsageError` where there is none.
    """
    wanted = next(iter(declared), None) if name is None else name
    if wanted is None:
        raise UsageError(f"`{ecm.id}` has no {what}")
    if wanted not in declared:
        near = did_you_mean(wanted, declared)
        hint = f"did you mean `{near}`?" if near else f"it has {', '.join(declared) or 'none'}"
        raise UsageError(f"`{ecm.id}` has no {what} `{escape_invisible(wanted)}`; {hint}")
    return declared[wanted]
