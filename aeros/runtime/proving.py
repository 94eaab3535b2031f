"""Site and module files → a proved configuration, as `run` and `decide` need it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing, nullcontext
from pathlib import Path
from typing import Protocol

from aeros.runtime.gate.configuration import Configuration, make_configuration
from aeros.spec.backends.answer_store import default_store
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.model import Ecm, OperatorOverride, Site
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.certificate import Certificate, certificate_for, check_lock
from aeros.spec.verification.reports import Report, SubjectReport
from aeros.spec.verification.verify import Detail, verify


class ProveConfiguration(Protocol):
    """What `prove_configuration` is, for who may be given another."""

    def __call__(
        self,
        paths: Iterable[Path],
        site: Path,
        *,
        certified: bool,
        blocks: Sequence[OperatorOverride] = (),
        active: Callable[[str], bool] = ...,
    ) -> tuple[Configuration, Report]:
        """See `prove_configuration`."""


def prove_configuration(
    paths: Iterable[Path],
    site: Path,
    *,
    certified: bool,
    blocks: Sequence[OperatorOverride] = (),
    active: Callable[[str], bool] = lambda _: True,
) -> tuple[Configuration, Report]:
    """The configuration of the modules at `paths`, all of them proved: here and now, or in an earlier run.

    What an earlier run proved counts if it was the very same files, policy and program
    (docs/decisions/0008-answers-are-kept.md); what depends on several modules is asked each time.

    certified: require that each module's `ecm.lock` is the certificate that results.
    blocks: operator overrides beside those of the site file.
    active: whether the module of that name is to be active.
    Raises `UserError` with every reason why the configuration is refused, `UndecidedError` where the
    only reasons are that the solver ran out of its budget.
    """
    store = default_store()
    with nullcontext() if store is None else closing(store):
        report = verify(paths, site, store=store, blocks=blocks, detail=Detail.BRIEF)
    if report.conclusion is not Conclusion.PROVED:
        refusal = UndecidedError if report.conclusion is Conclusion.UNDECIDED else UserError
        raise refusal([problem for subject in report.subjects for problem in subject.diagnostics])
    if certified:
        _require_locks(report)
    return configuration_of(report, site, blocks, active), report


def configuration_of(
    report: Report,
    site: Path,
    blocks: Sequence[OperatorOverride] = (),
    active: Callable[[str], bool] = lambda _: True,
) -> Configuration:
    """The models of what `report` says is proved, as `prove_configuration` makes them a configuration.

    Raises `UserError` where a file is not any more what was proved.
    """
    policy = _policy(site, blocks)
    proved = [one for one in report.modules if active(one.name)]
    return make_configuration(policy, {one.name: _certified(one, policy) for one in proved})


def _require_locks(report: Report) -> None:
    """Raise `UserError` unless every module's `ecm.lock` is the certificate that results."""
    problems = [
        problem
        for one in report.modules
        if one.lock is not None and not one.lock.matches_folder(one.path)
        if (problem := check_lock(one.path, one.lock.certificate)) is not None
    ]
    if problems:
        raise UserError(problems)


def _policy(path: Path, blocks: Sequence[OperatorOverride]) -> Site:
    site = load_site(path, Diagnostics())
    if site is None:
        raise _file_changed_error(path)
    return site.with_overrides(blocks)


def _certified(report: SubjectReport, policy: Site) -> tuple[Ecm, Certificate]:
    """The model of a module that is proved, and its certificate; it is of the very files that were proved."""
    found = load_ecm(report.path, policy, Diagnostics())
    certificate = report.certificate
    if found is None or certificate is None:
        raise _file_changed_error(report.path)
    if certificate_for(found.ecm, policy, certificate.obligations) != certificate:
        raise _file_changed_error(report.path)
    return found.ecm, certificate


def _file_changed_error(path: Path) -> UserError:
    return UserError([Diagnostic("AE961", f"`{path}` changed while it was being proved")])
