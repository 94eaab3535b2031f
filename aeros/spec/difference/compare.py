"""Comparison of two paths for `aeros diff`: reads both sides, pairs modules, and compares them.

Neither side is verified. What is compared is what the gate would allow, and Φ limits that, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, SpanLabel
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.difference.module_changes import module_changes
from aeros.spec.difference.other_changes import other_module_changes, other_site_changes
from aeros.spec.difference.policy_change import PolicyChange, Relation, finite_change
from aeros.spec.difference.site_changes import site_changes
from aeros.spec.elaborate.load import decode_manifest, decode_site, load_ecm, load_site
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import MANIFEST, module_folders
from aeros.spec.verification.modules_with_settings import absent_module_problems


@dataclass(frozen=True)
class PolicyDifference:
    """All changes between two sides.

    Attributes:
        changes: the changes.
        problems: reasons why a side could not be read; if there are any, nothing is compared.
    """

    changes: tuple[PolicyChange, ...] = ()
    problems: tuple[Diagnostic, ...] = ()

    @property
    def allows_more(self) -> bool:
        """True if anything is newly allowed."""
        return any(
            change.relation.allows_more or Relation.NEWLY_ALLOWED.value in change.witnesses
            for change in self.changes
        )

    @property
    def undecided(self) -> bool:
        """True if anything could not be compared or decided."""
        open_ = (Relation.UNDECIDED, Relation.NOT_COMPARABLE)
        return any(change.relation in open_ for change in self.changes)


def is_site(path: Path) -> bool:
    """Tell a site file from a manifest by its path.

    Args:
        path: file or folder.

    Returns:
        True if it is a site file: any file that is not a manifest.
    """
    return path.is_file() and path.name != MANIFEST


def compare(
    old: Path,
    new: Path,
    site_path: Path,
    oracle: Oracle | None = None,
    configurations: Mapping[str, ModuleConfiguration] = MappingProxyType({}),
) -> PolicyDifference:
    """Compare two site files, or two modules or folders of modules.

    Args:
        old: path of the old side.
        new: path of the new side, which decides what is compared.
        site_path: site under which modules are compared; unused for sites.
        oracle: answers the questions; None for one of the default budget.
        configurations: settings of the modules of both sides, by module; unused for sites.

    Returns:
        What going from `old` to `new` newly allows and denies, and all that changed otherwise.

    Raises:
        InternalError: a fault of AEROS: a file was read before and cannot be read now.
    """
    oracle = oracle or Oracle()
    sink = Diagnostics()
    if is_site(new):
        before, after = load_site(old, sink), load_site(new, sink)
        if before is None or after is None:
            return PolicyDifference(problems=tuple(sink))
        changes = tuple(site_changes(before, after, oracle))
        as_written = [decode_site(path) for path in (old, new)]
        if as_written[0] is None or as_written[1] is None:
            raise InternalError("a site that was read before cannot be read")
        changes += tuple(other_site_changes(as_written[0], as_written[1], changes))
        return PolicyDifference(changes, tuple(sink))
    site = load_site(site_path, sink)
    if site is not None:
        site = site.with_configurations(configurations)
    modules = [] if site is None else [_modules(path, site, sink) for path in (old, new)]
    folders = [one for path in (old, new) for one in module_folders(path, Diagnostics())]
    for problem in absent_module_problems(configurations, folders):
        sink.report(problem)
    if site is None or sink.has_errors:
        return PolicyDifference(problems=tuple(sink))
    return PolicyDifference(tuple(_compare_modules(modules[0], modules[1], site, oracle)), tuple(sink))


def _modules(path: Path, site: Site, sink: Diagnostics) -> dict[str, Ecm]:
    """Load the modules at or below `path`, by id."""
    found: dict[str, Ecm] = {}
    for folder in module_folders(path, sink):
        problems = Diagnostics()
        loaded = load_ecm(folder, site, problems)
        for problem in problems:
            sink.report(problem)
        if loaded is None:
            continue
        ecm = loaded.ecm
        if ecm.id in found:
            first = (SpanLabel(found[ecm.id].span, "first here"),)
            sink.error("AE120", f"two modules are called `{ecm.id}`", ecm.span, secondary=first)
        found[ecm.id] = ecm
    return found


def _compare_modules(
    old: dict[str, Ecm], new: dict[str, Ecm], site: Site, oracle: Oracle
) -> Iterator[PolicyChange]:
    """Compare modules of the same id; if each side has one module, these two."""
    if len(old) == len(new) == 1:
        ((before,), (after,)) = (old.values(), new.values())
        yield from _compare_versions(after.id, before, after, site, oracle)
        return
    for name in dict.fromkeys([*old, *new]):
        yield from _compare_versions(name, old.get(name), new.get(name), site, oracle)


def _compare_versions(
    name: str, old: Ecm | None, new: Ecm | None, site: Site, oracle: Oracle
) -> Iterator[PolicyChange]:
    """Compare two versions of a module; one that is on one side alone is reported as such.

    Raises:
        InternalError: a fault of AEROS: a manifest was read before and cannot be read now.
    """
    changes = tuple(module_changes(name, old, new, site, oracle))
    yield from changes
    if old is None or new is None:
        headline = f"the module `{name}` {'is new' if old is None else 'was removed'}"
        spans = (None if one is None else one.span for one in (old, new))
        yield finite_change(name, Relation.CHANGED_OTHERWISE, headline, *spans)
        return
    before, after = (decode_manifest(Path(one.folder)) for one in (old, new))
    if before is None or after is None:
        raise InternalError(f"the manifest of `{name}` was read before and cannot be read")
    yield from other_module_changes(name, before, after, changes)
