"""Proof of a site and of a module by itself: read, elaborate, make claims, discharge them, explain."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.resource_limit import MAX_TIMEOUTS, QUESTION_SECONDS
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, Severity, SpanLabel
from aeros.spec.diagnostics.missing_access import merge_missing_access
from aeros.spec.diagnostics.source import Source
from aeros.spec.diagnostics.unknown_names import merge_unknown_names
from aeros.spec.elaborate.load import LoadedEcm, elaborate_source, load_ecm
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from aeros.spec.model.site import Site
from aeros.spec.model.summary import ModuleSummary, summarize_module
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.dependencies import runtime_obligations
from aeros.spec.obligations.entry_points import entry_point_obligations
from aeros.spec.obligations.interfaces import interface_obligations
from aeros.spec.obligations.joint import joint_policy_obligations
from aeros.spec.obligations.models import model_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.policy import policy_obligations
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.skill_code import skill_code_obligations
from aeros.spec.obligations.skill_syntax.skill_source import read_skill_files
from aeros.spec.obligations.verdicts import Conclusion, StaticClaim, Verdict
from aeros.spec.text.discovery import MANIFEST, NEIGHBOURS, Surroundings
from aeros.spec.verification.claim_summary import (
    Claims,
    ClaimSummary,
    ListedClaims,
    diagnostics_of,
    summarize_static_claim,
)
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from aeros.spec.verification.explain import explain_findings
from aeros.spec.verification.repairs.module_repair import (
    Judge,
    ModuleVerdicts,
    find_module_repairs,
)
from aeros.spec.verification.repairs.quota_repair import find_quota_repairs
from aeros.spec.verification.repairs.repair import FailedClaim, Repair, advice
from aeros.spec.verification.reports import (
    ModuleFindings,
    SubjectReport,
    conclusion_of,
)
from aeros.worker_interrupts import deferred_interrupts, set_interrupt_handler


def examine_site(
    source: Source, oracle: Oracle, settings: OperatorSettings = NO_SETTINGS
) -> tuple[Site | None, SubjectReport]:
    """Prove the claims about a site.

    Args:
        source: text of the site file and its path.
        oracle: solver with its budget.
        settings: settings of the operator, in addition to those of the site.

    Returns:
        The site, None if the source does not declare one, and the report on it.
    """
    diagnostics, path = Diagnostics(), Path(source.path)
    site = elaborate_source(source, diagnostics)
    if site is None:
        problems = merge_unknown_names(diagnostics)
        return None, SubjectReport(str(path), path, Conclusion.REJECTED, problems, is_readable=False)
    site = settings.applied_to(site)
    settled, findings = _discharge_and_explain(
        (*policy_obligations(site), *joint_policy_obligations(site)), site, oracle
    )
    repairs = find_quota_repairs(site, source, settled)
    settled = tuple(_repaired_claim(one, repairs) for one in settled)
    problems = (*diagnostics, *_diagnostics(settled, findings))
    claims = Claims.from_claims((*map(summarize_static_claim, settled), *map(_summarize_finding, findings)))
    return site, SubjectReport(site.id, path, conclusion_of(problems), problems, claims, settled, findings)


def examine_module(
    folder: Path, site: Site, oracle: Oracle, surroundings: Surroundings = NEIGHBOURS
) -> ModuleFindings:
    """Prove the claims about a module by itself.

    Args:
        folder: the module's folder.
        site: site under which it is proved.
        oracle: solver with its budget.
        surroundings: the modules among which it finds those that it requires.

    Returns:
        The findings; a module that cannot be read has its faults only.
    """
    diagnostics = Diagnostics()
    loaded = load_ecm(folder, site, diagnostics, surroundings)
    if loaded is None:
        return ModuleFindings(None, merge_unknown_names(diagnostics))
    ecm = loaded.ecm
    site, outer = site.with_modules(ecm.with_owners), site
    presence = summarize_module(ecm)
    before, claims = _claims_of(loaded, site)
    settled, findings = _discharge_and_explain(claims, site, oracle, _readable_variables(ecm, site))
    settled, findings = _with_module_repairs(
        loaded,
        site,
        (before, settled, findings),
        oracle,
        lambda text: _judge(folder, outer, oracle, surroundings, text),
    )
    before_summaries, settled_summaries = (
        tuple(map(summarize_static_claim, before)),
        tuple(map(summarize_static_claim, settled)),
    )
    return ModuleFindings(
        presence,
        (*diagnostics, *_without_empty_envelopes(diagnostics_of(before_summaries), findings)),
        ListedClaims(before_summaries, (*settled_summaries, *map(_summarize_finding, findings))),
        (*merge_missing_access(_diagnostics(settled, findings)), *_needless_runtime_checks(ecm, findings)),
        findings=(ecm, before, settled, findings),
    )


def _claims_of(
    loaded: LoadedEcm, site: Site
) -> tuple[tuple[StaticClaim, ...], tuple[Obligation | StaticClaim, ...]]:
    """Make all claims about a module: those about its files and versions, then those about its text."""
    ecm = loaded.ecm
    files = read_skill_files(ecm.folder, loaded.code)
    before = (
        *entry_point_obligations(ecm, files),
        *skill_code_obligations(ecm, site, files),
        *model_obligations(ecm),
        *runtime_obligations(summarize_module(ecm)),
    )
    claims = (
        *permission_obligations(ecm, site),
        *safety_obligations(ecm, site),
        *composition_obligations(ecm, site),
        *interface_obligations(ecm, site),
        *closed_loop_obligations(ecm, site),
    )
    return before, claims


_Settled = tuple[Iterable[StaticClaim], Iterable[StaticClaim], Iterable[ObligationResult]]
"""Claims about files and versions, settled claims, and results of obligations."""


def _with_module_repairs(
    loaded: LoadedEcm,
    site: Site,
    settled: tuple[tuple[StaticClaim, ...], tuple[StaticClaim, ...], tuple[ObligationResult, ...]],
    oracle: Oracle,
    judge: Judge,
) -> tuple[tuple[StaticClaim, ...], tuple[ObligationResult, ...]]:
    """Add the repairs that are proved on the whole module to the claims that failed."""
    _, static, findings = settled
    failed = [
        FailedClaim(one.id, one.diagnostic)
        for one in static
        if one.diagnostic is not None and one.verdict is Verdict.REFUTED and one.diagnostic.fix is None
    ]
    failed += [
        FailedClaim(one.obligation.id, diagnostic)
        for one in findings
        if one.verdict is Verdict.REFUTED
        and one.fix is None
        and (diagnostic := diagnostic_of(one)) is not None
    ]
    manifest = loaded.ecm.access_span.source
    # A loop of very many states takes seconds to analyse, and would be analysed again for each edit.
    if not failed or Path(manifest.path).name != MANIFEST or any(one.engine for one in static):
        return static, findings
    repairs = find_module_repairs(
        loaded.ecm, site, manifest, failed, _verdicts_of(settled), judge, oracle.with_reduced_budget(10)
    )
    return (
        tuple(_repaired_claim(one, repairs) for one in static),
        tuple(
            replace(one, repair=repairs[one.obligation.id].line, fix=repairs[one.obligation.id].fix)
            if one.obligation.id in repairs
            else one
            for one in findings
        ),
    )


def _repaired_claim(claim: StaticClaim, repairs: Mapping[ClaimId, Repair]) -> StaticClaim:
    """Add its repair, if there is one, to what a claim reports."""
    found, repair = claim.diagnostic, repairs.get(claim.id)
    if found is None or repair is None:
        return claim
    return replace(claim, diagnostic=replace(found, help=(advice(repair.line), *found.help), fix=repair.fix))


def _judge(
    folder: Path, site: Site, oracle: Oracle, surroundings: Surroundings, manifest: Source
) -> ModuleVerdicts | None:
    """Prove a module with another manifest; None if that has faults of its own."""
    diagnostics = Diagnostics()
    loaded = load_ecm(folder, site, diagnostics, surroundings, manifest=manifest)
    if loaded is None or any(True for _ in diagnostics):
        return None
    before, claims = _claims_of(loaded, site.with_modules(loaded.ecm.with_owners))
    open_ = [one for one in claims if isinstance(one, Obligation)]
    static = [one for one in claims if isinstance(one, StaticClaim)]
    return _verdicts_of((before, static, discharge_obligations(open_, oracle)))


def _verdicts_of(settled: _Settled) -> ModuleVerdicts:
    before, static, findings = settled
    static, findings = [*before, *static], list(findings)
    gate = {str(one.obligation.id) for one in findings if one.is_runtime_checked}
    failing = {str(one.id) for one in static if one.diagnostic is not None}
    failing |= {
        str(one.obligation.id)
        for one in findings
        if one.verdict is not Verdict.PROVED and not one.is_runtime_checked
    }
    return ModuleVerdicts(
        frozenset(failing),
        frozenset([*(str(one.id) for one in static), *(str(one.obligation.id) for one in findings)]),
        frozenset(gate),
    )


def summarize_folder(
    folder: Path, site: Site, surroundings: Surroundings = NEIGHBOURS
) -> ModuleSummary | None:
    """Read the module in a folder and summarize it for others.

    Args:
        folder: the module's folder.
        site: site under which it is elaborated.
        surroundings: the modules among which it finds those that it requires.

    Returns:
        The summary; None if the module cannot be read.
    """
    loaded = load_ecm(folder, site, Diagnostics(), surroundings)
    return None if loaded is None else summarize_module(loaded.ecm)


_WORKER_STATE: dict[str, tuple[Site, Oracle, Surroundings]] = {}
"""Site, oracle and surroundings of the modules of a worker process."""


def examine_modules_in_processes(
    folders: Sequence[Path],
    site: Source,
    settings: OperatorSettings,
    rlimit: int,
    jobs: int,
    *,
    seconds: float = QUESTION_SECONDS,
    surroundings: Surroundings = NEIGHBOURS,
) -> Iterator[ModuleFindings]:
    """Prove modules by themselves in several processes, which end when the caller stops iterating.

    Args:
        folders: the modules' folders.
        site: text of the site file and its path.
        settings: settings of the operator, in addition to those of the site.
        rlimit: the solver's budget for one query, in Z3 resource units.
        jobs: number of processes.
        seconds: time limit for one query, s.
        surroundings: the modules among which each finds those that it requires.

    Yields:
        The findings on each module in order, without the model and the claims in full.
    """
    # These take 20 ms to import, which runs with few modules need not pay.
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    # Spawned and not forked: a fork would copy locks held by threads of the caller.
    arguments = (site, settings, rlimit, seconds, surroundings)
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _init_worker, arguments)
    try:
        with deferred_interrupts():
            found = pool.map(_verify_in_worker, folders, chunksize=4)
        yield from found
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _init_worker(
    source: Source,
    settings: OperatorSettings,
    rlimit: int,
    seconds: float,
    surroundings: Surroundings,
) -> None:
    set_interrupt_handler(signal.SIG_IGN)  # the parent process gets the signal and stops the others
    site = elaborate_source(source, Diagnostics())
    if site is not None:
        _WORKER_STATE["site"] = (
            settings.applied_to(site),
            Oracle(rlimit, seconds=seconds, max_timeouts=MAX_TIMEOUTS),
            surroundings,
        )
    # Proofs make almost no reference cycles, and this process ends with the run: garbage collection would
    # take some hundredths of its time and free almost nothing.
    gc.disable()


def _verify_in_worker(folder: Path) -> ModuleFindings:
    return replace(examine_module(folder, *_WORKER_STATE["site"]), findings=None)


def _without_empty_envelopes(
    problems: Iterable[Diagnostic], findings: Iterable[ObligationResult]
) -> Iterator[Diagnostic]:
    """Leave out actions of code outside of an envelope that has none: the envelope is reported itself."""
    empty = [
        one.obligation.primary.span
        for one in findings
        if one.verdict is Verdict.VACUOUS and one.obligation.code == "AE503"
    ]
    for problem in problems:
        parts = [label.span for label in problem.secondary] if problem.code == "AE148" else []
        if not any(
            span.source == part.source and span.start <= part.start and part.end <= span.end
            for span in empty
            for part in parts
        ):
            yield problem


def _readable_variables(ecm: Ecm, site: Site) -> frozenset[str]:
    """Return the site's state variables of which a module may use the sensors."""
    sensors = ecm.requested_access.sensors
    return frozenset(name for name, one in site.state.items() if one.sensor is None or one.sensor in sensors)


def _summarize_finding(finding: ObligationResult) -> ClaimSummary:
    one = finding.obligation
    witness = None if finding.witness is None else tuple(finding.witness.lines())
    guard = one.runtime_checked_rule if finding.is_runtime_checked else None
    return ClaimSummary(one.id, finding.verdict, guard, finding.boundary, witness, diagnostic_of(finding))


def _discharge_and_explain(
    claims: Iterable[Obligation | StaticClaim],
    site: Site,
    oracle: Oracle,
    readable: frozenset[str] = frozenset(),
) -> tuple[tuple[StaticClaim, ...], tuple[ObligationResult, ...]]:
    listed = list(claims)
    open_ = [claim for claim in listed if isinstance(claim, Obligation)]
    settled = tuple(claim for claim in listed if isinstance(claim, StaticClaim))
    return settled, explain_findings(discharge_obligations(open_, oracle), site, oracle, readable)


def _diagnostics(
    settled: Iterable[StaticClaim], findings: Iterable[ObligationResult]
) -> Iterator[Diagnostic]:
    for one in settled:
        if one.diagnostic is not None:
            yield one.diagnostic
    findings = list(findings)
    vacuous = {
        _claim_subject(f)
        for f in findings
        if f.verdict is Verdict.VACUOUS and f.obligation.code in ("AE503", "AE603")
    }
    for finding in findings:
        # An empty envelope is also dead, and a rule that denies nothing is also redundant: report it once.
        if finding.obligation.code in ("AE502", "AE604") and _claim_subject(finding) in vacuous:
            continue
        diagnostic = diagnostic_of(finding)
        if diagnostic is not None:
            yield diagnostic


def _claim_subject(finding: ObligationResult) -> tuple[str, ...]:
    """Return the group and the names of a claim: the envelope or the rule that it is about."""
    claim_id = finding.obligation.id
    return (claim_id.group, *claim_id.names)


def diagnostic_of(finding: ObligationResult) -> Diagnostic | None:
    """Make the diagnostic of a finding.

    Args:
        finding: the result of an obligation.

    Returns:
        The diagnostic; None if the claim is proved or left to the gate.
    """
    one = finding.obligation
    if finding.verdict is Verdict.PROVED or finding.is_runtime_checked:
        return None
    if finding.verdict is Verdict.UNKNOWN:
        return Diagnostic(
            "AE509",
            f"undecided, so refused: {one.id}",
            one.primary,
            one.secondary,
            notes=(f"the solver said: {finding.reason}",),
            help=(
                "raise `--rlimit` or `--question-timeout`, whichever ran out, or write the conditions with "
                "fewer products of variables",
            ),
        )
    notes = one.notes
    if finding.witness is not None and finding.witness.variables:
        notes += ("for example, with\n" + "\n".join(finding.witness.lines()),)
    primary, *secondary = finding.labels or (one.primary, *one.secondary)
    help_ = (advice(finding.repair),) if finding.repair else ()
    return Diagnostic(
        one.code,
        one.headline,
        primary,
        tuple(secondary),
        notes,
        (*help_, *one.help),
        fix=finding.fix,
    )


def _needless_runtime_checks(ecm: Ecm, findings: Iterable[ObligationResult]) -> Iterator[Diagnostic]:
    """Warn of invariants under `gated` that are proved of every action.

    The manifest need not leave them to the gate.
    """
    verdicts: dict[tuple[str, str], set[Verdict]] = {}
    for finding in findings:
        claim_id = finding.obligation.id
        if claim_id.form is ClaimForm.ENVELOPE_OBEYS:
            about = claim_id.name_of("skill"), claim_id.name_of("invariant")
            verdicts.setdefault(about, set()).add(finding.verdict)
    for skill in ecm.skills.values():
        if skill.leaves_any_to_gate:
            continue
        for rule, span in skill.runtime_checked.items():
            if verdicts.get((skill.id, rule)) == {Verdict.PROVED}:
                yield Diagnostic(
                    "AE505",
                    f"`{rule}` is proved for every action that `{skill.id}` may ask for",
                    SpanLabel(span),
                    help=("remove it from `gated`",),
                    severity=Severity.WARNING,
                )
