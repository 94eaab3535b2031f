"""Verification of modules: find cached proofs, prove the rest, report.  `aeros verify` prints the result.

Cached proofs come from the proof cache (`proof_cache`), which is asked before anything is proved and is given
the new proofs afterwards.  The code that proves (`examine`) takes 0.2 s to import, so a run that finds
everything never imports it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT, MAX_TIMEOUTS, QUESTION_SECONDS
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError, MisuseError, UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from aeros.spec.model.summary import ModuleSummary, SiteSummary, summarize_site
from aeros.spec.obligations.absent_modules import names_near
from aeros.spec.text.discovery import Surroundings, all_module_folders
from aeros.spec.text.site_layers import read_site
from aeros.spec.verification.proof_cache import ProofCache
from aeros.spec.verification.reports import (
    Known,
    ModuleFindings,
    Progress,
    Report,
    SubjectReport,
    configuration_report,
    dependency_candidates,
    missing_module_report,
    module_report,
    unreadable_site_report,
    with_required,
)

if TYPE_CHECKING:
    from aeros.spec.backends.oracle import Oracle
    from aeros.spec.backends.solver_results import SecondSolver
    from aeros.spec.model.site import Site
    from aeros.spec.verification.second_opinion.cross_check import SecondSolverReport
    from aeros.spec.verification.second_opinion.encodings import EncodingReport
    from aeros.spec.verification.second_opinion.listed_loops import ListedLoopsReport

MIN_MODULES_FOR_POOL: Final = 16
"""Smallest number of modules that are proved by more than one process."""


class Detail(Enum):
    """The amount of detail in a report."""

    FULL = "full"  # everything is proved again; models, claims and findings are in the report
    BRIEF = "brief"  # cached proofs are used; no models, and claims without formulas


def verify(
    paths: Iterable[Path],
    site_path: Path,
    rlimit: int = DEFAULT_RLIMIT,
    progress: Progress = lambda _: None,
    store: AnswerStore | None = None,
    settings: OperatorSettings = NO_SETTINGS,
    second: SecondSolver | None = None,
    *,
    detail: Detail = Detail.FULL,
    jobs: int = 1,
    seconds: float = QUESTION_SECONDS,
    active: Collection[Path] | None = None,
    strict: bool = False,
) -> Report:
    """Prove the modules at `paths` under the site at `site_path`.

    Args:
        paths: module folders, or folders of these.
        site_path: the site file.
        rlimit: the solver's budget for one query, in Z3 resource units.
        progress: called with the name of the subject that is proved next.
        store: answers of the solver and, for a brief report, proofs of earlier runs; None to use none.
        settings: settings of the operator, in addition to those of the site file.
        second: a solver that is asked everything again, even if answers were kept.
        detail: amount of detail in the report.
        jobs: number of processes that prove modules for a brief report, where there are many modules.
        seconds: the solver's time limit for one query, s.
        active: folders of the active modules, which provide a capability if any of them does.  Where it is
            given, requirements are met by the given modules alone, and else also by modules next to them.
        strict: with a second solver, also compare the encodings of every question with the definition.

    Returns:
        The report.  Modules that cannot be read or proved are in it, as is a site that cannot.

    Raises:
        DisagreementError: `second` decides a query otherwise than Z3 does, or an encoding is wrong.
        MisuseError: `second` is given for a brief report, for which not everything is asked.
    """
    if second is not None and detail is not Detail.FULL:
        raise MisuseError("a second solver is asked everything, so the report has to be in full")
    progress(f"site {site_path}")
    diagnostics = Diagnostics()
    folders = all_module_folders(paths, diagnostics)
    refused = missing_module_report(diagnostics)
    surroundings = (
        Surroundings(named=tuple(folders))
        if active is None
        else Surroundings(tuple(folders), frozenset(active))
    )
    try:
        source = read_site(site_path)
    except UserError as error:
        return Report(unreadable_site_report(site_path, error), refused, None)
    prover = _LazyProver(
        source,
        settings,
        rlimit,
        store,
        jobs,
        detail=detail,
        second=second,
        seconds=seconds,
        surroundings=surroundings,
        strict=strict,
    )
    if store is None or detail is Detail.FULL:
        report, _ = _report(folders, refused, prover, Known(), prover.summarize_module, progress)
        return report
    cache = ProofCache(store, source, rlimit, settings, surroundings)

    def summarize(folder: Path) -> ModuleSummary | None:
        found = cache.find_module(folder)
        return prover.summarize_module(folder) if found is None else found.summary

    report, new = _report(folders, refused, prover, cache.find(folders), summarize, progress)
    cache.keep(report, new)
    return report


def _report(
    folders: Sequence[Path],
    refused: tuple[SubjectReport, ...],
    prover: _LazyProver,
    known: Known,
    summarize: Callable[[Path], ModuleSummary | None],
    progress: Progress,
) -> tuple[Report, Known]:
    """Prove the site, each module by itself, and the claims on several modules, except what is known.

    Args:
        folders: folders of the modules.
        refused: reports on paths that hold no module.
        prover: proves what is not known.
        known: findings of earlier runs.
        summarize: summarizes a module that is not given, by its folder; None where it cannot be read.
        progress: called with the name of the subject that is proved next.

    Returns:
        The report, and the findings that were not known.
    """
    site, site_report = prover.site() if known.site is None else known.site
    if site is None:
        return Report(site_report, refused, None), Known()
    proved = prover.modules([folder for folder in folders if folder not in known.modules], progress)
    findings = {
        folder: known.modules[folder] if folder in known.modules else proved[folder] for folder in folders
    }
    given = {folder: one.summary for folder, one in findings.items() if one.summary is not None}
    around = dependency_candidates(given, summarize, prover.surroundings)
    modules = [module_report(folder, one, site, around) for folder, one in findings.items()]
    loops = prover.listed_loops(proved.values(), progress)
    agreement, encodings = prover.agreement(progress), prover.encodings(progress)
    prover.close()
    others = _others_with_settings(site, given, folders, prover.surroundings)
    together = with_required(list(given.values()), around) if len(given) > 1 else list(given.values())
    configuration = configuration_report(together, site, others)
    about_site = replace(site_report, variables=site.variables)
    report = Report(
        about_site, (*refused, *modules), prover.site_model, configuration, agreement, encodings, loops
    )
    return report, Known((site, site_report) if known.site is None else None, proved)


def _others_with_settings(
    site: SiteSummary,
    given: Mapping[Path, ModuleSummary],
    folders: Sequence[Path],
    surroundings: Surroundings,
) -> Collection[str]:
    """Return names of modules that could not be read, or that the policy names and that are near."""
    known = {one.id for one in given.values()}
    absent = (site.settings.keys() | names_near(known, site)) - known
    if not absent:
        return ()
    # Imported here, as it costs time that most runs need not pay.
    from aeros.spec.verification.modules_with_settings import other_modules

    return other_modules(absent, [one for one in folders if one not in given], folders, surroundings)


class _LazyProver:
    """Prover of what is not known.  Importing the code costs 0.2 s, which other runs need not pay."""

    def __init__(
        self,
        source: Source,
        settings: OperatorSettings,
        rlimit: int,
        store: AnswerStore | None,
        jobs: int,
        *,
        detail: Detail,
        second: SecondSolver | None,
        seconds: float,
        surroundings: Surroundings,
        strict: bool,
    ) -> None:
        self._strict = strict
        self._seconds = seconds
        self.surroundings = surroundings
        self._source = source
        self._settings = settings
        self._rlimit = rlimit
        self._store = store
        self._jobs = jobs
        self._in_full = detail is Detail.FULL
        self._second = second

    @cached_property
    def _oracle(self) -> Oracle:
        from aeros.spec.backends.oracle import Oracle

        return Oracle(
            self._rlimit,
            self._store,
            recording=self._second is not None,
            seconds=self._seconds,
            max_timeouts=MAX_TIMEOUTS,
        )

    @cached_property
    def _site(self) -> Site:
        """The site, which was found to be readable before.

        Raises:
            InternalError: a fault of AEROS: the file cannot be read now.
        """
        from aeros.spec.elaborate.load import elaborate_source

        site = elaborate_source(self._source, Diagnostics())
        if site is None:
            raise InternalError(f"`{self._source.path}` was kept as proved and cannot be read")
        return self._settings.applied_to(site)

    @property
    def site_model(self) -> Site | None:
        """The site for the report; None for a brief one."""
        return self._site if self._in_full else None

    def site(self) -> tuple[SiteSummary | None, SubjectReport]:
        """Prove the site; return its summary, None where it cannot be read, and the report on it."""
        from aeros.spec.verification.examine import examine_site

        site, report = examine_site(self._source, self._oracle, self._settings)
        if not self._in_full:
            report = replace(report, static_claims=(), findings=())
        if site is None:
            return None, report
        self._site = site
        return summarize_site(site), report

    def modules(self, folders: Sequence[Path], progress: Progress) -> dict[Path, ModuleFindings]:
        """Prove each module by itself."""
        examined: dict[Path, ModuleFindings] = {}
        results = self._examined(folders) if folders else iter(())
        for done, folder in enumerate(folders, 1):
            progress(f"{done} of {len(folders)}: {folder}")
            examined[folder] = next(results)
        return examined

    def _examined(self, folders: Sequence[Path]) -> Iterator[ModuleFindings]:
        from aeros.spec.verification.examine import examine_module, examine_modules_in_processes

        if not self._in_full and self._jobs > 1 and len(folders) >= MIN_MODULES_FOR_POOL:
            return examine_modules_in_processes(
                folders,
                self._source,
                self._settings,
                self._rlimit,
                self._jobs,
                seconds=self._seconds,
                surroundings=self.surroundings,
            )
        around = self.surroundings
        results = (examine_module(folder, self._site, self._oracle, around) for folder in folders)
        return results if self._in_full else (replace(one, findings=None) for one in results)

    def summarize_module(self, folder: Path) -> ModuleSummary | None:
        """Summarize the module in `folder` for others; return None where it cannot be read."""
        from aeros.spec.verification.examine import summarize_folder

        return summarize_folder(folder, self._site, self.surroundings)

    def listed_loops(
        self, findings: Iterable[ModuleFindings], progress: Progress
    ) -> ListedLoopsReport | None:
        """Prove listed loops by certificates, where there is a second solver, which then gets them."""
        if self._second is None:
            return None
        from aeros.spec.verification.second_opinion.listed_loops import certify_listed_loops

        modules = [one.findings[0] for one in findings if one.findings is not None]
        around = [(ecm, self._site.with_modules(ecm.with_owners)) for ecm in modules]
        return certify_listed_loops(around, self._oracle, progress)

    def agreement(self, progress: Progress) -> SecondSolverReport | None:
        """Put every query to the second solver, where there is one."""
        if self._second is None:
            return None
        from aeros.spec.verification.second_opinion.cross_check import cross_check_queries

        return cross_check_queries(self._oracle.asked.values(), self._second, progress)

    def encodings(self, progress: Progress) -> EncodingReport | None:
        """Compare the encodings of every query with the definition, where that is asked for."""
        if self._second is None or not self._strict:
            return None
        from aeros.spec.verification.second_opinion.encodings import compare_encodings

        return compare_encodings(self._oracle.asked.values(), progress)

    def close(self) -> None:
        """Put the solver's answers into the store."""
        if "_oracle" in self.__dict__:
            self._oracle.save_answers()
