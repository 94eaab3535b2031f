"""Reports on a site, on modules and on all of them together; imports nothing that proves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, Severity
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.summary import ComposedScenes, ModuleSummary, SiteSummary
from aeros.spec.obligations.absent_modules import misspelt_policy_names, settings_obligations
from aeros.spec.obligations.claim_id import ClaimId
from aeros.spec.obligations.configuration import configuration_obligations
from aeros.spec.obligations.dependencies import dependency_obligations
from aeros.spec.obligations.verdicts import Conclusion, StaticClaim
from aeros.spec.text.discovery import NEIGHBOURS, Surroundings
from aeros.spec.verification.certificate import GUARDED, Certificate, LockFile, certificate_for
from aeros.spec.verification.claim_summary import (
    ClaimCounts,
    Claims,
    ClaimSummary,
    ListedClaims,
    OwnClaims,
    diagnostics_of,
    summarize_static_claim,
)

if TYPE_CHECKING:
    from aeros.spec.model.ecm import Ecm
    from aeros.spec.model.site import Site
    from aeros.spec.verification.discharge import ObligationResult
    from aeros.spec.verification.second_opinion.cross_check import SecondSolverReport
    from aeros.spec.verification.second_opinion.encodings import EncodingReport
    from aeros.spec.verification.second_opinion.listed_loops import ListedLoopsReport


Progress = Callable[[str], None]
"""Called with a line of text that says what is done next."""


@dataclass(frozen=True)
class SubjectReport:
    """Report on one site or module.

    Attributes:
        name: its id, or its path where it could not be read.
        path: its file or folder.
        conclusion: the conclusion.
        diagnostics: all diagnostics, in order.
        claims: summaries of all claims that were examined.
        static_claims: claims settled when made, in full; empty where only the report was asked for.
        findings: results of the other claims, in full; empty where only the report was asked for.
        lock: the expected `ecm.lock` of a module that is PROVED.
        ecm: the model of a module; None where only the report was asked for.
        variables: its own state variables, a module's without its own name, each with the members of its
            enum.
        scenes: scenes that a module's tasks name, and where.
        composed_scenes: of a module's tasks that name no scene and compose others, the scenes of these.
        measured_by_site: full names of a module's own variables that a sensor of the site measures.
        needed_cameras: the site's names of cameras without which a perceiver or skill does not work.
        left_out: outcomes of probability 0, as in `look.not_here`, which a module's closed loops leave out.
        cameras: for a module and each that it requires, the site's names of cameras by the module's.
        is_readable: False if its files could not be read or understood.
    """

    name: str
    path: Path
    conclusion: Conclusion
    diagnostics: tuple[Diagnostic, ...]
    claims: Claims = Claims.from_claims(())  # noqa: RUF009  it cannot be changed
    static_claims: tuple[StaticClaim, ...] = ()
    findings: tuple[ObligationResult, ...] = ()
    lock: LockFile | None = None
    ecm: Ecm | None = None
    variables: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    scenes: Mapping[str, SourceSpan] = field(default_factory=dict)
    composed_scenes: tuple[ComposedScenes, ...] = ()
    measured_by_site: tuple[str, ...] = ()
    needed_cameras: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    cameras: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    is_readable: bool = True

    @property
    def certificate(self) -> Certificate | None:
        """The certificate of a module that is PROVED."""
        return None if self.lock is None else self.lock.certificate

    @property
    def claim_count(self) -> int:
        """The number of claims that were examined."""
        return len(self.claims)

    @property
    def boundaries(self) -> tuple[tuple[str, str], ...]:
        """Each rule that the gate decides, with the condition under which it allows; each pair once."""
        return tuple((rule, boundary) for rule, boundary, _ in self.claims.tally.runtime_checked)

    @property
    def runtime_checked_count(self) -> int:
        """The number of claims that the gate decides each time."""
        return sum(count for *_, count in self.claims.tally.runtime_checked)


@dataclass(frozen=True)
class Report:
    """Report on a site and the modules that were verified under it.

    Attributes:
        site: report on the site.
        modules: reports on the modules.
        site_model: the site; None where it could not be read, or where only the report was asked for.
        configuration: report on all modules together; None unless several can be read.
        agreement: result of a second solver, where one was asked.
        encodings: result of the comparison of encodings, where it was asked for.
        listed_loops: result of proving closed loops a second time, where a second solver was asked.

    Example:
        >>> report = aeros.verify("no/such/folder")
        >>> report.conclusion.value
        'rejected'
        >>> [problem.headline for subject in report.subjects for problem in subject.diagnostics]
        ['there is no file or folder `no/such/folder`']
    """

    site: SubjectReport
    modules: tuple[SubjectReport, ...]
    site_model: Site | None
    configuration: SubjectReport | None = None
    agreement: SecondSolverReport | None = None
    encodings: EncodingReport | None = None
    listed_loops: ListedLoopsReport | None = None

    @property
    def is_confirmed(self) -> bool:
        """True if each question that was asked a second time was read and decided."""
        undecided = () if self.agreement is None else self.agreement.undecided_queries
        loops = () if self.listed_loops is None else self.listed_loops.uncertified
        unread = () if self.encodings is None else self.encodings.unread_questions
        return not (undecided or loops or unread)

    @property
    def subjects(self) -> tuple[SubjectReport, ...]:
        """The site, the modules, and then their configuration where there is one.

        Each has a `name`, `path`, `conclusion` and `diagnostics`. A diagnostic has a `code`, a `headline`,
        `notes`, `help` and, if it has a place, `primary.span` with `source.path`, `line`, `column`.
        """
        together = () if self.configuration is None else (self.configuration,)
        return (self.site, *self.modules, *together)

    @property
    def conclusion(self) -> Conclusion:
        """REJECTED if anything is, else UNDECIDED if anything is, else PROVED.  `value` is its text."""
        conclusions = {subject.conclusion for subject in self.subjects}
        for worst in (Conclusion.REJECTED, Conclusion.UNDECIDED):
            if worst in conclusions:
                return worst
        return Conclusion.PROVED


@dataclass(frozen=True)
class ModuleFindings:
    """Findings on one module by itself.

    Attributes:
        summary: the module as other modules see it; None where it could not be read.
        first_problems: diagnostics that come before those about other modules.
        claims: its claims except those about other modules.
        last_problems: diagnostics that come after those about other modules.
        lock_digest: SHA-256 of the text of its certificate if its dependencies are met; None where the
            certificate was not made yet.
        findings: the model, the static claims before and after those about other modules, and the results of
            the other claims; None where only the report is asked for.
    """

    summary: ModuleSummary | None
    first_problems: tuple[Diagnostic, ...] = ()
    claims: OwnClaims = ListedClaims()  # noqa: RUF009  it cannot be changed
    last_problems: tuple[Diagnostic, ...] = ()
    lock_digest: str | None = None
    findings: (
        tuple[Ecm, tuple[StaticClaim, ...], tuple[StaticClaim, ...], tuple[ObligationResult, ...]] | None
    ) = None


class Known:
    """Earlier findings on a site and on modules under it.

    Args:
        site: summary of the site and the report on it; None where it is still to be proved.
        modules: findings by folder; modules that are left out are still to be proved.
    """

    def __init__(
        self,
        site: tuple[SiteSummary, SubjectReport] | None = None,
        modules: Mapping[Path, ModuleFindings] = MappingProxyType({}),
    ) -> None:
        self.site = site
        self.modules = modules


def unreadable_site_report(path: Path, error: UserError) -> SubjectReport:
    """Report on a site whose file cannot be read.

    Args:
        path: path of the site file.
        error: the reason.

    Returns:
        A report that rejects the site.
    """
    return SubjectReport(str(path), path, Conclusion.REJECTED, error.diagnostics, is_readable=False)


def missing_module_report(diagnostics: Diagnostics) -> tuple[SubjectReport, ...]:
    """Report on paths that hold no module.

    Args:
        diagnostics: faults of the search for modules.

    Returns:
        One report with all of them if there is an error, else none.
    """
    return (
        (SubjectReport("", Path(), Conclusion.REJECTED, tuple(diagnostics)),)
        if diagnostics.has_errors
        else ()
    )


def module_report(
    folder: Path, one: ModuleFindings, site: SiteSummary, co_installed: Mapping[str, ModuleSummary]
) -> SubjectReport:
    """Report on a module, including claims about other modules; cached claims are read when needed.

    Args:
        folder: the module's folder.
        one: findings on the module by itself.
        site: summary of the site.
        co_installed: the modules that its dependencies may refer to, by name.

    Returns:
        The report.
    """
    presence = one.summary
    if presence is None:
        return SubjectReport(str(folder), folder, Conclusion.REJECTED, one.first_problems, is_readable=False)
    dependencies = tuple(dependency_obligations(presence, co_installed))
    of_others = tuple(map(summarize_static_claim, dependencies))

    def read() -> Iterable[ClaimSummary]:
        before, after = one.claims.read()
        return (*before, *of_others, *after)

    tally = one.claims.tally
    claims = Claims(ClaimCounts(tally.claims + len(of_others), tally.runtime_checked), read)
    problems = (*one.first_problems, *diagnostics_of(of_others), *one.last_problems)
    conclusion = conclusion_of(problems)
    lock = _lock(conclusion, presence, site, claims, one.lock_digest)
    report = SubjectReport(
        presence.id,
        folder,
        conclusion,
        problems,
        claims,
        lock=lock,
        variables=presence.variables,
        scenes=presence.scenes,
        composed_scenes=presence.composed_scenes,
        measured_by_site=presence.measured_by_site,
        needed_cameras=presence.needed_cameras,
        left_out=presence.left_out,
        cameras=presence.cameras,
    )
    if one.findings is None:
        return report
    ecm, before, after, findings = one.findings
    return replace(report, static_claims=(*before, *dependencies, *after), findings=findings, ecm=ecm)


def _lock(
    conclusion: Conclusion, presence: ModuleSummary, site: SiteSummary, claims: Claims, digest: str | None
) -> LockFile | None:
    """Return the expected `ecm.lock` of a module that is PROVED; `digest` is that of its text, if known."""

    def certify() -> Certificate:
        engines = {claim.id: claim.engine for claim in claims if claim.engine}
        return certificate_for(presence, site, certificate_verdicts(claims), engines)

    return LockFile(certify, digest) if conclusion is Conclusion.PROVED else None


def certificate_verdicts(claims: Iterable[ClaimSummary]) -> dict[ClaimId, str]:
    """Collect the verdicts on the claims about a module that is PROVED, as its certificate holds them.

    Args:
        claims: summaries of all its claims.

    Returns:
        PROVED or GUARDED for each claim.

    Raises:
        InternalError: two claims have one identity, so one verdict would hide the other.
    """
    verdicts: dict[ClaimId, str] = {}
    for claim in claims:
        if claim.id in verdicts:
            raise InternalError(f"two claims have one identity: {claim.id}")
        verdicts[claim.id] = claim.verdict.value if claim.runtime_checked_rule is None else GUARDED
    return verdicts


def configuration_report(
    modules: Sequence[ModuleSummary], site: SiteSummary, others: Collection[str] = ()
) -> SubjectReport | None:
    """Report on several modules together.

    Args:
        modules: summaries of the modules.
        site: summary of the site.
        others: names of further modules that the policy may name.

    Returns:
        The report; None for fewer than two modules, unless the policy names one that is absent.
    """
    names = {*(one.id for one in modules), *others}
    settings = tuple(settings_obligations(site.settings, names)) if names else ()
    if len(modules) < 2:
        names_of_policy = (claim for one in modules for claim in misspelt_policy_names(one, site, names))
        settled = (*(one for one in settings if one.diagnostic is not None), *names_of_policy)
    else:
        settled = (*configuration_obligations(modules, site), *settings)
    if not settled:
        return None
    claims = Claims.from_claims(map(summarize_static_claim, settled))
    problems = diagnostics_of(claims)
    return SubjectReport("configuration", Path(), conclusion_of(problems), problems, claims, settled)


def dependency_candidates(
    given: Mapping[Path, ModuleSummary],
    read: Callable[[Path], ModuleSummary | None],
    surroundings: Surroundings = NEIGHBOURS,
) -> dict[str, ModuleSummary]:
    """Find the modules that dependencies may refer to: those given, and those next to one that has any.

    Args:
        given: summaries of the given modules, by folder.
        read: reads a module that is not given, by its folder; returns None where it cannot be read.
        surroundings: the modules among which each finds those that it requires.

    Returns:
        The summaries by module name; given modules win.
    """
    needing = [folder for folder, one in given.items() if one.has_requirements]
    places = {surroundings.place(folder.resolve()) for folder in needing} - {None}
    known = {folder.resolve() for folder in given} if places else set()
    around: dict[str, ModuleSummary] = {}
    for place in places:
        for neighbour in surroundings.members(place):
            if neighbour.resolve() not in known:
                summary = read(neighbour)
                around |= {} if summary is None else {summary.id: summary}
    return around | {one.id: one for one in given.values()}


def conclusion_of(problems: Iterable[Diagnostic]) -> Conclusion:
    """Draw the conclusion from diagnostics.

    Args:
        problems: all diagnostics of a report.

    Returns:
        PROVED without errors, UNDECIDED if all errors are undecided claims, else REJECTED.
    """
    errors = {problem.code for problem in problems if problem.severity is Severity.ERROR}
    if not errors:
        return Conclusion.PROVED
    return Conclusion.UNDECIDED if errors <= {"AE509", "AE803"} else Conclusion.REJECTED
