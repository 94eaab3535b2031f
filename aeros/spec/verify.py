"""Paths → reports: reads, elaborates, proves, certifies.  What `aeros verify` does, without printing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from aeros.spec.agreement import Agreement, SecondSolver, agreement_on
from aeros.spec.answers import answered
from aeros.spec.backends.budget import DEFAULT_RLIMIT
from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.store import Store
from aeros.spec.certificate import Certificate, certificate_for
from aeros.spec.diagnostics import Diagnostic, Diagnostics, Fix, Label, Severity
from aeros.spec.discharge import Finding, discharge
from aeros.spec.loading import MANIFEST, LoadedEcm, load_ecm, load_site, module_folders
from aeros.spec.model import Block, Ecm, Site
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.configuration import configuration_obligations
from aeros.spec.obligations.dependencies import dependency_obligations
from aeros.spec.obligations.entry_points import entry_point_obligations
from aeros.spec.obligations.joint import joint_policy_obligations
from aeros.spec.obligations.obligation import Claim, Obligation, Settled, Verdict
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.policy import policy_obligations
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.skill_code import skill_code_obligations


class Conclusion(Enum):
    """What a report comes to.  Has no truth value on purpose: callers compare."""

    PROVED = "proved"
    REJECTED = "rejected"
    UNDECIDED = "undecided"

    def __bool__(self) -> bool:
        raise TypeError("a conclusion has no truth value; compare it")


@dataclass(frozen=True)
class SubjectReport:
    """What was found of one site or module.

    name: its id, or its path where it could not be read.
    certificate: of a module that is PROVED.
    """

    name: str
    path: Path
    conclusion: Conclusion
    diagnostics: tuple[Diagnostic, ...]
    settled: tuple[Settled, ...] = ()
    findings: tuple[Finding, ...] = ()
    certificate: Certificate | None = None
    ecm: Ecm | None = None

    @property
    def obligation_count(self) -> int:
        """How many claims were examined."""
        return len(self.settled) + len(self.findings)

    @property
    def boundaries(self) -> tuple[tuple[str, str], ...]:
        """Each rule that the gate decides, with what has to hold for it to allow; each pair once."""
        return tuple(dict.fromkeys((str(one.obligation.guard), one.boundary) for one in self.guarded))

    @property
    def guarded(self) -> tuple[Finding, ...]:
        """The claims that the gate decides, each time."""
        return tuple(finding for finding in self.findings if finding.guarded)


@dataclass(frozen=True)
class Report:
    """A site and the modules that were verified under it.

    configuration: of all modules together; None unless there are several that can be read.
    agreement: of a second solver, where one was asked.
    """

    site: SubjectReport
    modules: tuple[SubjectReport, ...]
    site_model: Site | None
    configuration: SubjectReport | None = None
    agreement: Agreement | None = None

    @property
    def subjects(self) -> tuple[SubjectReport, ...]:
        """The site, the modules, and then their configuration where there is one."""
        together = () if self.configuration is None else (self.configuration,)
        return (self.site, *self.modules, *together)

    @property
    def conclusion(self) -> Conclusion:
        """REJECTED if anything is, else UNDECIDED if anything is, else PROVED."""
        conclusions = {subject.conclusion for subject in self.subjects}
        for worst in (Conclusion.REJECTED, Conclusion.UNDECIDED):
            if worst in conclusions:
                return worst
        return Conclusion.PROVED


Progress = Callable[[str], None]


def verify(
    paths: Iterable[Path],
    site_path: Path,
    rlimit: int = DEFAULT_RLIMIT,
    progress: Progress = lambda _: None,
    store: Store | None = None,
    blocks: Sequence[Block] = (),
    second: SecondSolver | None = None,
) -> Report:
    """Everything that can be said of the modules at `paths` under the site at `site_path`.

    progress: told the name of each subject before it is proved.
    store: answers of earlier runs, where the caller wants them used.
    blocks: operator overrides beside those of the site file.
    second: asked everything again, whether or not the answers were kept; raises DisagreementError where
        it decides otherwise than Z3.
    """
    oracle = Oracle(rlimit, store, recording=second is not None)
    progress(f"site {site_path}")
    site, site_report = _verify_site(site_path, oracle, blocks)
    reports: list[SubjectReport] = []
    sink = Diagnostics()
    folders = list(dict.fromkeys(folder for path in paths for folder in module_folders(path, sink)))
    if sink.has_errors:
        reports.append(SubjectReport("", Path(), Conclusion.REJECTED, tuple(sink)))
    if site is None:
        return Report(site_report, tuple(reports), None)
    loaded = {folder: _load(folder, site) for folder in folders}
    around = _modules_around(loaded, site)
    for folder in folders:
        progress(str(folder))
        found, problems = loaded[folder]
        if found is None:
            reports.append(SubjectReport(str(folder), folder, Conclusion.REJECTED, problems))
        else:
            reports.append(_verify_ecm(found, folder, site, around, problems, oracle))
    agreement = None if second is None else agreement_on(oracle.asked.values(), second, progress)
    oracle.keep()
    together = _verify_configuration([report.ecm for report in reports if report.ecm is not None], site)
    return Report(site_report, tuple(reports), site, together, agreement)


def _verify_configuration(ecms: Sequence[Ecm], site: Site) -> SubjectReport | None:
    """What is to be said of several modules together."""
    if len(ecms) < 2:
        return None
    settled = tuple(configuration_obligations(ecms, site))
    problems = tuple(_diagnostics(settled, ()))
    return SubjectReport("configuration", Path(), _conclude(problems), problems, settled)


def _load(folder: Path, site: Site) -> tuple[LoadedEcm | None, tuple[Diagnostic, ...]]:
    sink = Diagnostics()
    return load_ecm(folder, site, sink), tuple(sink)


def _modules_around(
    loaded: Mapping[Path, tuple[LoadedEcm | None, tuple[Diagnostic, ...]]], site: Site
) -> dict[str, Ecm]:
    """The modules that dependencies may refer to: those given, and those beside one that has any."""
    given = {folder: found.ecm for folder, (found, _) in loaded.items() if found is not None}
    around: dict[str, Ecm] = {}
    for parent in {folder.resolve().parent for folder, ecm in given.items() if ecm.requires}:
        for beside in sorted(parent.iterdir()):
            found = load_ecm(beside, site, Diagnostics()) if (beside / MANIFEST).is_file() else None
            if found is not None:
                around[found.ecm.id] = found.ecm
    return around | {ecm.id: ecm for ecm in given.values()}


def _verify_site(path: Path, oracle: Oracle, blocks: Sequence[Block]) -> tuple[Site | None, SubjectReport]:
    sink = Diagnostics()
    site = load_site(path, sink)
    if site is not None:
        site = site.with_blocks(blocks)
    if site is None:
        return None, SubjectReport(str(path), path, Conclusion.REJECTED, tuple(sink))
    settled, findings = _settle((*policy_obligations(site), *joint_policy_obligations(site)), site, oracle)
    problems = (*sink, *_diagnostics(settled, findings))
    return site, SubjectReport(site.id, path, _conclude(problems), problems, settled, findings)


def _verify_ecm(
    loaded: LoadedEcm,
    folder: Path,
    site: Site,
    around: Mapping[str, Ecm],
    warnings: tuple[Diagnostic, ...],
    oracle: Oracle,
) -> SubjectReport:
    ecm = loaded.ecm
    claims = (
        *entry_point_obligations(ecm, loaded.code),
        *skill_code_obligations(ecm, site, loaded.code),
        *dependency_obligations(ecm, around),
        *permission_obligations(ecm, site),
        *safety_obligations(ecm, site),
        *composition_obligations(ecm, site),
        *closed_loop_obligations(ecm, site),
    )
    settled, findings = _settle(claims, site, oracle)
    problems = (*warnings, *_diagnostics(settled, findings), *_needless_gates(ecm, findings))
    conclusion = _conclude(problems)
    certificate = None
    if conclusion is Conclusion.PROVED:
        verdicts = {one.id: one.verdict.value for one in settled}
        verdicts |= {one.obligation.id: "GUARDED" if one.guarded else one.verdict.value for one in findings}
        certificate = certificate_for(ecm, site, verdicts)
    return SubjectReport(ecm.id, folder, conclusion, problems, settled, findings, certificate, ecm)


def _settle(
    claims: Iterable[Obligation | Settled], site: Site, oracle: Oracle
) -> tuple[tuple[Settled, ...], tuple[Finding, ...]]:
    listed = list(claims)
    open_ = [claim for claim in listed if isinstance(claim, Obligation)]
    settled = tuple(claim for claim in listed if isinstance(claim, Settled))
    return settled, answered(discharge(open_, oracle), site, oracle)


def _conclude(problems: Iterable[Diagnostic]) -> Conclusion:
    errors = {problem.code for problem in problems if problem.severity is Severity.ERROR}
    if not errors:
        return Conclusion.PROVED
    return Conclusion.UNDECIDED if errors <= {"AE509", "AE803"} else Conclusion.REJECTED


def _diagnostics(settled: Iterable[Settled], findings: Iterable[Finding]) -> Iterator[Diagnostic]:
    for one in settled:
        if one.diagnostic is not None:
            yield one.diagnostic
    findings = list(findings)
    vacuous = {
        _subject(f)
        for f in findings
        if f.verdict is Verdict.VACUOUS and f.obligation.code in ("AE503", "AE603")
    }
    for finding in findings:
        # Of an empty envelope nothing is allowed, and whatever denies nothing is implied by anything:
        # to say so once is enough.
        if finding.obligation.code in ("AE502", "AE604") and _subject(finding) in vacuous:
            continue
        diagnostic = diagnostic_of(finding)
        if diagnostic is not None:
            yield diagnostic


def _subject(finding: Finding) -> tuple[str, ...]:
    """The envelope or the rule that an obligation is about: its id without the claim's own word."""
    claims = ("not-empty", "not-dead", "effective", "unshadowed")
    return tuple(part for part in finding.obligation.id.split("/") if part not in claims)


def diagnostic_of(finding: Finding) -> Diagnostic | None:
    """What to say of a finding that is not a proof; nothing of what is proved or left to the gate."""
    one = finding.obligation
    if finding.verdict is Verdict.PROVED or finding.guarded:
        return None
    if finding.verdict is Verdict.UNKNOWN:
        return Diagnostic(
            "AE509",
            f"undecided, so refused: whether {one.id}",
            one.primary,
            one.secondary,
            notes=(f"the solver said: {finding.reason}",),
            help=("raise `--rlimit`, or write the conditions with fewer products of variables",),
        )
    notes = one.notes
    if finding.witness is not None and finding.witness.declared:
        notes += ("for example, with\n" + "\n".join(finding.witness.lines()),)
    primary, *secondary = finding.labels or (one.primary, *one.secondary)
    help_ = (f"write `{finding.repair}`",) if finding.repair else ()
    return Diagnostic(
        one.code,
        one.headline,
        primary,
        tuple(secondary),
        notes,
        (*help_, *one.help),
        fix=_fix(finding),
    )


def _fix(finding: Finding) -> Fix | None:
    """The repair as an edit of the file, where the envelope stands on one line."""
    clause = finding.obligation.clause
    if not finding.repair or clause is None or clause.span.line != clause.span.end_line:
        return None
    return Fix(clause.span, finding.repair.partition(": ")[2])


def _needless_gates(ecm: Ecm, findings: Iterable[Finding]) -> Iterator[Diagnostic]:
    """Warn of invariants under `gated` that are proved of every action: the manifest could promise more."""
    verdicts: dict[tuple[str, str], set[Verdict]] = {}
    for finding in findings:
        group, skill_id, _, rule_id = (*finding.obligation.id.split("/"), "", "")[:4]
        if group == "safety" and finding.obligation.claim is Claim.ALWAYS:
            verdicts.setdefault((skill_id, rule_id), set()).add(finding.verdict)
    for skill in ecm.skills.values():
        for rule, span in skill.gated.items():
            if verdicts.get((skill.id, rule)) == {Verdict.PROVED}:
                yield Diagnostic(
                    "AE505",
                    f"`{rule}` is proved of all that `{skill.id}` may ask for",
                    Label(span),
                    help=("remove it from `gated`",),
                    severity=Severity.WARNING,
                )
