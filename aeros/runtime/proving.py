"""Proved configurations from site and module files, for the commands that run or decide."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Protocol

from aeros.runtime.gate.configuration import Configuration, make_configuration
from aeros.spec.backends.answer_store import open_default_store
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from aeros.spec.model.site import Site
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import NEIGHBOURS, Surroundings, reference_site_path
from aeros.spec.verification.certificate import Certificate, certificate_for, check_lock
from aeros.spec.verification.reports import Report, SubjectReport
from aeros.spec.verification.verify import Detail, verify


class ProveConfiguration(Protocol):
    """Type of `prove_configuration`, for callers that accept a substitute."""

    def __call__(
        self,
        paths: Iterable[Path],
        site: Path,
        *,
        certified: bool,
        settings: OperatorSettings = NO_SETTINGS,
        active: Callable[[str], bool] = ...,
        active_folders: Collection[Path] | None = None,
    ) -> tuple[Configuration, Report]:
        """Implement `prove_configuration`."""


def prove_configuration(
    paths: Iterable[Path],
    site: Path,
    *,
    certified: bool,
    settings: OperatorSettings = NO_SETTINGS,
    active: Callable[[str], bool] = lambda _: True,
    active_folders: Collection[Path] | None = None,
) -> tuple[Configuration, Report]:
    """Prove modules under a site, and return the configuration that the gate enforces.

    A proof from an earlier run counts if files, policy and program have not changed since
    (docs/decisions/0008-answers-are-kept.md). Obligations about several modules are checked every time.

    Args:
        paths: folders of the modules to prove.
        site: the site file.
        certified: require that each module's `ecm.lock` equals the certificate that results, or is one of
            the same files under another policy.
        settings: settings of the operator, in addition to those of the site file.
        active: predicate on the module name; only modules for which it is true become active.
        active_folders: their folders.  Where they are given, requirements are met by the modules at `paths`
            alone, and else also by modules next to them.

    Returns:
        The configuration of the active modules, and the report of the verification.

    Raises:
        UserError: a module is refuted, malformed, changed while it was being proved, or its `ecm.lock` is
            neither of these; the error lists every problem.
        UndecidedError: nothing is refuted, but the solver ran out of its budget.
    """
    paths = tuple(paths)
    with open_default_store() as store:
        report = verify(
            paths, site, store=store, settings=settings, detail=Detail.BRIEF, active=active_folders
        )
    if report.conclusion is not Conclusion.PROVED:
        refusal = UndecidedError if report.conclusion is Conclusion.UNDECIDED else UserError
        raise refusal([problem for subject in report.subjects for problem in subject.diagnostics])
    if certified:
        _require_locks(report, site, settings)
    surroundings = (
        Surroundings(named=tuple(module.path for module in report.modules))
        if active_folders is None
        else Surroundings(paths, frozenset(active_folders))
    )
    return configuration_of(report, site, settings, active, surroundings), report


def configuration_of(
    report: Report,
    site: Path,
    settings: OperatorSettings = NO_SETTINGS,
    active: Callable[[str], bool] = lambda _: True,
    surroundings: Surroundings = NEIGHBOURS,
) -> Configuration:
    """Build the configuration of the modules that a report says are proved.

    Args:
        report: a report whose conclusion is PROVED.
        site: the site file.
        settings: settings of the operator, in addition to those of the site file.
        active: predicate on the module name; only modules for which it is true become active.
        surroundings: the modules among which each finds those that it requires.

    Returns:
        The configuration of the active modules.

    Raises:
        UserError: a file is no longer the one that was proved.
    """
    policy = _policy(site, settings)
    proved = [module for module in report.modules if active(module.name)]
    certified = {module.name: _certified(module, policy, surroundings) for module in proved}
    return make_configuration(policy, certified)


def _require_locks(report: Report, site: Path, settings: OperatorSettings) -> None:
    """Compare every module's `ecm.lock` with the certificate that results.

    One of another site is no objection: the module has just been proved under this one.

    Raises:
        UserError: some of them differ.
    """
    given = None if site == reference_site_path() else site
    problems = [
        problem
        for module in report.modules
        if module.lock is not None and not module.lock.matches_folder(module.path)
        if (
            problem := check_lock(
                module.path,
                module.lock.certificate,
                given,
                settings.configurations,
                accepts_other_setup=True,
            )
        )
        is not None
    ]
    if problems:
        raise UserError(problems)


def _policy(path: Path, settings: OperatorSettings) -> Site:
    site = load_site(path, Diagnostics())
    if site is None:
        raise _file_changed_error(path)
    return settings.applied_to(site)


def _certified(report: SubjectReport, policy: Site, surroundings: Surroundings) -> tuple[Ecm, Certificate]:
    """Load a proved module and check that its files are still the ones that were proved.

    Raises:
        UserError: a file has changed since.
    """
    found = load_ecm(report.path, policy, Diagnostics(), surroundings)
    certificate = report.certificate
    if found is None or certificate is None:
        raise _file_changed_error(report.path)
    if certificate_for(found.ecm, policy, certificate.obligations, certificate.engines) != certificate:
        raise _file_changed_error(report.path)
    return found.ecm, certificate


def _file_changed_error(path: Path) -> UserError:
    return UserError([Diagnostic("AE961", f"`{path}` changed while it was being proved")])
