"""Paths → reports in brief, without models: what an earlier run proved is found, and the rest proved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.spec.backends.budget import DEFAULT_RLIMIT
from aeros.spec.backends.store import Store
from aeros.spec.diagnostics import Diagnostics
from aeros.spec.errors import InternalError, UserError
from aeros.spec.folders import module_folders
from aeros.spec.keeping import Keeper, Kept
from aeros.spec.presence import Presence, SitePresence, presence_of_site
from aeros.spec.reports import (
    Examined,
    Progress,
    Report,
    SubjectReport,
    modules_around,
    report_on,
    report_on_configuration,
    report_on_kept,
    report_on_paths,
    report_on_unreadable,
)
from aeros.spec.source import Source
from aeros.spec.texts import read_source
from aeros.spec.told import Claims
from aeros.spec.verdicts import Conclusion

if TYPE_CHECKING:
    from aeros.spec.backends.oracle import Oracle
    from aeros.spec.model import Block, Site

MANY: Final = 16
"""From this many modules on, more than one process proves them."""


def verify_in_brief(
    paths: Iterable[Path],
    site_path: Path,
    rlimit: int = DEFAULT_RLIMIT,
    progress: Progress = lambda _: None,
    store: Store | None = None,
    *,
    blocks: Sequence[Block] = (),
    jobs: int = 1,
) -> Report:
    """What `verify` reports, without models and claims in full.

    progress: told which subject is proved next.
    store: what earlier runs proved and were answered, where the caller wants it used.
    blocks: operator overrides beside those of the site file.
    jobs: how many processes prove modules, where there are many.
    """
    progress(f"site {site_path}")
    sink = Diagnostics()
    folders = list(dict.fromkeys(folder for path in paths for folder in module_folders(path, sink)))
    refused = report_on_paths(sink)
    try:
        source = read_source(site_path)
    except UserError as error:
        return Report(report_on_unreadable(site_path, error), refused, None)
    prover = _Prover(source, tuple(blocks), rlimit, store, jobs)
    keeper = None if store is None else Keeper(store, source, rlimit, blocks)
    site, site_report = _site(prover, keeper)
    if site is None:
        return Report(site_report, refused, None)
    kept = {} if keeper is None else keeper.find_all(folders)
    examined = _examined([folder for folder in folders if folder not in kept], prover, progress)
    found = {folder: kept[folder] if folder in kept else examined[folder] for folder in folders}
    given = {folder: one.presence for folder, one in found.items() if one.presence is not None}
    around = modules_around(given, prover.presence_in)
    modules = [
        report_on_kept(folder, one, site, around)
        if isinstance(one, Kept)
        else report_on(folder, one, site, around)
        for folder, one in found.items()
    ]
    prover.keep()
    if keeper is not None:
        for report in modules:
            if report.path in examined:
                _keep(report, examined[report.path], keeper)
        keeper.close()
    configuration = report_on_configuration(list(given.values()), site)
    return Report(site_report, (*refused, *modules), None, configuration)


class _Prover:
    """Proves what was not kept.  Importing what that takes costs 0.2 s, which other runs need not pay."""

    def __init__(
        self, source: Source, blocks: tuple[Block, ...], rlimit: int, store: Store | None, jobs: int
    ) -> None:
        self.source = source
        self._blocks = blocks
        self._rlimit = rlimit
        self._store = store
        self._jobs = jobs

    @cached_property
    def _oracle(self) -> Oracle:
        from aeros.spec.backends.oracle import Oracle

        return Oracle(self._rlimit, self._store)

    @cached_property
    def _site(self) -> Site:
        """The site, of which it was found before that it can be read."""
        from aeros.spec.loading import site_of

        site = site_of(self.source, Diagnostics())
        if site is None:
            raise InternalError(f"`{self.source.path}` was kept as proved and cannot be read")
        return site.with_blocks(self._blocks)

    def site(self) -> tuple[SitePresence | None, SubjectReport]:
        """The site as others see it, and what there is to say of it."""
        from aeros.spec.verify import verify_site

        site, report = verify_site(self.source, self._oracle, self._blocks)
        if site is None:
            return None, report
        self._site = site
        return presence_of_site(site), replace(report, settled=(), findings=())

    def examined(self, folders: Sequence[Path]) -> Iterator[Examined]:
        """What there is to say of each module by itself."""
        from aeros.spec.verify import examine, examine_in_processes

        if self._jobs > 1 and len(folders) >= MANY:
            return examine_in_processes(folders, self.source, self._blocks, self._rlimit, self._jobs)
        site, oracle = self._site, self._oracle
        return (replace(examine(folder, site, oracle), full=None) for folder in folders)

    def presence_in(self, folder: Path) -> Presence | None:
        """What others have to know of the module in `folder`; None where it cannot be read."""
        from aeros.spec.verify import presence_in

        return presence_in(folder, self._site)

    def keep(self) -> None:
        """Put what the solver answered into the store."""
        if "_oracle" in self.__dict__:
            self._oracle.keep()


def _site(prover: _Prover, keeper: Keeper | None) -> tuple[SitePresence | None, SubjectReport]:
    kept = None if keeper is None else keeper.find_site()
    if kept is not None:
        path, claims = Path(prover.source.path), Claims.of(kept.claims)
        return kept.presence, SubjectReport(kept.presence.id, path, Conclusion.PROVED, (), claims)
    site, report = prover.site()
    if keeper is not None and site is not None and _is_proved(report):
        keeper.keep_site(site, report.claims)
    return site, report


def _examined(folders: Sequence[Path], prover: _Prover, progress: Progress) -> dict[Path, Examined]:
    """What there is to say of each module that was not kept."""
    examined: dict[Path, Examined] = {}
    found = prover.examined(folders) if folders else iter(())
    for done, folder in enumerate(folders, 1):
        progress(f"{done} of {len(folders)}: {folder}")
        examined[folder] = next(found)
    return examined


def _keep(report: SubjectReport, one: Examined, keeper: Keeper) -> None:
    """Keep what is proved and leaves nothing to say."""
    if one.presence is not None and report.lock is not None and _is_proved(report):
        keeper.keep(one.presence, one.before, one.after, report.lock.digest)


def _is_proved(report: SubjectReport) -> bool:
    return report.conclusion is Conclusion.PROVED and not report.diagnostics
