"""Paths → reports: reads, elaborates, proves, certifies.  What `aeros verify` does, without printing."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
from aeros.spec.keeping import Keeper, Kept
from aeros.spec.loading import MANIFEST, load_ecm, load_site, module_folders
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
from aeros.spec.presence import Presence, presence_of
from aeros.spec.told import Told


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
    claims: everything that was examined.
    certificate: of a module that is PROVED.
    settled, findings, ecm: the claims in full and the model; left out where only the report was asked for.
    """

    name: str
    path: Path
    conclusion: Conclusion
    diagnostics: tuple[Diagnostic, ...]
    claims: tuple[Told, ...] = ()
    settled: tuple[Settled, ...] = ()
    findings: tuple[Finding, ...] = ()
    certificate: Certificate | None = None
    ecm: Ecm | None = None

    @property
    def obligation_count(self) -> int:
        """How many claims were examined."""
        return len(self.claims)

    @property
    def boundaries(self) -> tuple[tuple[str, str], ...]:
        """Each rule that the gate decides, with what has to hold for it to allow; each pair once."""
        return tuple(dict.fromkeys((str(one.guard), one.boundary) for one in self.guarded))

    @property
    def guarded(self) -> tuple[Told, ...]:
        """The claims that the gate decides, each time."""
        return tuple(one for one in self.claims if one.guard is not None)


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

MANY = 16
"""From this many modules on, more than one process proves them."""


def verify(
    paths: Iterable[Path],
    site_path: Path,
    rlimit: int = DEFAULT_RLIMIT,
    progress: Progress = lambda _: None,
    store: Store | None = None,
    blocks: Sequence[Block] = (),
    second: SecondSolver | None = None,
    *,
    in_full: bool = True,
    jobs: int = 1,
) -> Report:
    """Everything that can be said of the modules at `paths` under the site at `site_path`.

    progress: told which subject is proved next.
    store: answers of earlier runs, where the caller wants them used.
    blocks: operator overrides beside those of the site file.
    second: asked everything again, whether or not the answers were kept; raises DisagreementError where
        it decides otherwise than Z3.
    in_full: with every claim and model; else `store` may have what was proved of a whole module, and up
        to `jobs` processes prove the others.  The report says the same.  With `blocks` or a `second`
        solver it always is.
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
    in_full = in_full or bool(blocks) or second is not None
    keeper = None if in_full or store is None else Keeper(store, site, rlimit)
    kept = {} if keeper is None else _kept(folders, keeper)
    missing = [folder for folder in folders if folder not in kept]
    if in_full or jobs < 2 or len(missing) < MANY:
        new = _here(missing, site, oracle, in_full=in_full)
    else:
        new = _in_processes(missing, site_path, rlimit, jobs)
    examined = dict(kept)
    for done, folder in enumerate(missing, 1):
        progress(f"{done} of {len(missing)}: {folder}")
        examined[folder] = next(new)
    if keeper is not None:
        _keep([(folder, examined[folder]) for folder in missing], keeper)
    around = _modules_around(examined, site)
    reports += [_report(folder, examined[folder], site, around) for folder in folders]
    agreement = None if second is None else agreement_on(oracle.asked.values(), second, progress)
    oracle.keep()
    present = [one.presence for folder in folders if (one := examined[folder]).presence is not None]
    return Report(site_report, tuple(reports), site, _verify_configuration(present, site), agreement)


@dataclass(frozen=True)
class _Examined:
    """What was found of one module by itself.

    presence: what others have to know of it; None where it could not be read.
    before, after: its claims but for those about other modules, which come between them.
    warnings, problems: what there is to say before and after what the settled claims say.
    settled: how many claims of `after` were settled when they were made.
    full: the model, and what it has before, after, and open; None where only the report is asked for.
    """

    presence: Presence | None
    warnings: tuple[Diagnostic, ...] = ()
    before: tuple[Told, ...] = ()
    after: tuple[Told, ...] = ()
    settled: int = 0
    problems: tuple[Diagnostic, ...] = ()
    full: tuple[Ecm, tuple[Settled, ...], tuple[Settled, ...], tuple[Finding, ...]] | None = None


def _kept(folders: Iterable[Path], keeper: Keeper) -> dict[Path, _Examined]:
    found = ((folder, keeper.find(folder)) for folder in folders)
    return {
        folder: _Examined(one.presence, (), one.before, one.after) for folder, one in found if one is not None
    }


def _keep(examined: Iterable[tuple[Path, _Examined]], keeper: Keeper) -> None:
    """Keep what is proved and leaves nothing to say."""
    for folder, one in examined:
        told = (*one.warnings, *one.problems, *_said(one.before), *_said(one.after))
        if one.presence is not None and not told:
            keeper.keep(folder, Kept(one.presence, one.before, one.after))
    keeper.close()


def _here(folders: Iterable[Path], site: Site, oracle: Oracle, *, in_full: bool) -> Iterator[_Examined]:
    for folder in folders:
        examined = _examine(folder, site, oracle)
        yield examined if in_full else replace(examined, full=None)


_WORKING: dict[str, tuple[Site, Oracle]] = {}
"""The site and the oracle of a process that was started to prove modules."""


def _in_processes(folders: Sequence[Path], site: Path, rlimit: int, jobs: int) -> Iterator[_Examined]:
    """What `_here` yields, proved by several processes; they end when the caller stops listening."""
    # These modules take 20 ms to import, which few modules need not pay.
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    # Spawned and not forked, as a caller may have threads, whose locks a fork would take along.
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _start_working, (site, rlimit))
    try:
        yield from pool.map(_work, folders, chunksize=4)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _start_working(site_path: Path, rlimit: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that is asked to stop tells the others
    site = load_site(site_path, Diagnostics())
    if site is not None:
        _WORKING["site"] = (site, Oracle(rlimit))


def _work(folder: Path) -> _Examined:
    site, oracle = _WORKING["site"]
    return replace(_examine(folder, site, oracle), full=None)


def _verify_configuration(modules: Sequence[Presence], site: Site) -> SubjectReport | None:
    """What is to be said of several modules together."""
    if len(modules) < 2:
        return None
    settled = tuple(configuration_obligations(modules, site))
    claims = tuple(map(_told_settled, settled))
    problems = _said(claims)
    return SubjectReport("configuration", Path(), _conclude(problems), problems, claims, settled)


def _modules_around(examined: Mapping[Path, _Examined], site: Site) -> dict[str, Presence]:
    """The modules that dependencies may refer to: those given, and those beside one that has any."""
    given = {folder: one.presence for folder, one in examined.items() if one.presence is not None}
    known = {folder.resolve() for folder in given}
    around: dict[str, Presence] = {}
    for parent in {folder.resolve().parent for folder, one in given.items() if one.requires}:
        for beside in sorted(parent.iterdir()):
            if beside not in known and (beside / MANIFEST).is_file():
                found = load_ecm(beside, site, Diagnostics())
                around |= {} if found is None else {found.ecm.id: presence_of(found.ecm)}
    return around | {one.id: one for one in given.values()}


def _verify_site(path: Path, oracle: Oracle, blocks: Sequence[Block]) -> tuple[Site | None, SubjectReport]:
    sink = Diagnostics()
    site = load_site(path, sink)
    if site is not None:
        site = site.with_blocks(blocks)
    if site is None:
        return None, SubjectReport(str(path), path, Conclusion.REJECTED, tuple(sink))
    settled, findings = _settle((*policy_obligations(site), *joint_policy_obligations(site)), site, oracle)
    problems = (*sink, *_diagnostics(settled, findings))
    claims = (*map(_told_settled, settled), *map(_told, findings))
    return site, SubjectReport(site.id, path, _conclude(problems), problems, claims, settled, findings)


def _examine(folder: Path, site: Site, oracle: Oracle) -> _Examined:
    sink = Diagnostics()
    loaded = load_ecm(folder, site, sink)
    if loaded is None:
        return _Examined(None, tuple(sink))
    ecm = loaded.ecm
    before = (*entry_point_obligations(ecm, loaded.code), *skill_code_obligations(ecm, site, loaded.code))
    claims = (
        *permission_obligations(ecm, site),
        *safety_obligations(ecm, site),
        *composition_obligations(ecm, site),
        *closed_loop_obligations(ecm, site),
    )
    settled, findings = _settle(claims, site, oracle)
    return _Examined(
        presence_of(ecm),
        tuple(sink),
        tuple(map(_told_settled, before)),
        (*map(_told_settled, settled), *map(_told, findings)),
        len(settled),
        (*_diagnostics((), findings), *_needless_gates(ecm, findings)),
        (ecm, before, settled, findings),
    )


def _report(folder: Path, one: _Examined, site: Site, around: Mapping[str, Presence]) -> SubjectReport:
    """What there is to say of a module, with what depends on others."""
    if one.presence is None:
        return SubjectReport(str(folder), folder, Conclusion.REJECTED, one.warnings)
    dependencies = tuple(dependency_obligations(one.presence, around))
    first = (*one.before, *map(_told_settled, dependencies))
    claims = (*first, *one.after)
    problems = (*one.warnings, *_said(first), *_said(one.after[: one.settled]), *one.problems)
    conclusion = _conclude(problems)
    certificate = None
    if conclusion is Conclusion.PROVED:
        verdicts = {told.id: told.verdict.value if told.guard is None else "GUARDED" for told in claims}
        certificate = certificate_for(one.presence, site, verdicts)
    name = one.presence.id
    if one.full is None:
        return SubjectReport(name, folder, conclusion, problems, claims, certificate=certificate)
    ecm, before, after, findings = one.full
    settled = (*before, *dependencies, *after)
    return SubjectReport(name, folder, conclusion, problems, claims, settled, findings, certificate, ecm)


def _told_settled(one: Settled) -> Told:
    return Told(one.id, one.verdict, diagnostic=one.diagnostic)


def _told(finding: Finding) -> Told:
    one = finding.obligation
    witness = None if finding.witness is None else tuple(finding.witness.lines())
    guard = one.guard if finding.guarded else None
    return Told(one.id, finding.verdict, guard, finding.boundary, witness, diagnostic_of(finding))


def _said(claims: Iterable[Told]) -> tuple[Diagnostic, ...]:
    return tuple(one.diagnostic for one in claims if one.diagnostic is not None)


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
