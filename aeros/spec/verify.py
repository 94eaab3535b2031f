"""Paths → reports: reads, elaborates, proves, certifies.  What `aeros verify` does, without printing."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from aeros.spec.agreement import SecondSolver, agreement_on
from aeros.spec.answers import answered
from aeros.spec.backends.budget import DEFAULT_RLIMIT
from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.store import Store
from aeros.spec.diagnostics import Diagnostic, Diagnostics, Fix, Label, Severity
from aeros.spec.discharge import Finding, discharge
from aeros.spec.errors import UserError
from aeros.spec.folders import module_folders
from aeros.spec.loading import load_ecm, site_of
from aeros.spec.model import Block, Ecm, Site
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.dependencies import runtime_obligations
from aeros.spec.obligations.entry_points import entry_point_obligations
from aeros.spec.obligations.joint import joint_policy_obligations
from aeros.spec.obligations.obligation import Claim, Obligation
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.policy import policy_obligations
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.skill_code import skill_code_obligations
from aeros.spec.obligations.skill_source import read_skill_files
from aeros.spec.presence import Presence, presence_of, presence_of_site
from aeros.spec.reports import (
    Examined,
    Progress,
    Report,
    SubjectReport,
    conclude,
    modules_around,
    report_on,
    report_on_configuration,
    report_on_paths,
    report_on_unreadable,
)
from aeros.spec.source import Source
from aeros.spec.texts import read_source
from aeros.spec.told import Claims, Told, told_of
from aeros.spec.verdicts import Conclusion, Settled, Verdict


def verify(
    paths: Iterable[Path],
    site_path: Path,
    rlimit: int = DEFAULT_RLIMIT,
    progress: Progress = lambda _: None,
    store: Store | None = None,
    blocks: Sequence[Block] = (),
    second: SecondSolver | None = None,
) -> Report:
    """Everything that can be said of the modules at `paths` under the site at `site_path`, in full.

    progress: told which subject is proved next.
    store: answers of earlier runs, where the caller wants them used.
    blocks: operator overrides beside those of the site file.
    second: asked everything again, whether or not the answers were kept; raises DisagreementError where
        it decides otherwise than Z3.
    """
    oracle = Oracle(rlimit, store, recording=second is not None)
    progress(f"site {site_path}")
    try:
        site, site_report = verify_site(read_source(site_path), oracle, blocks)
    except UserError as error:
        site, site_report = None, report_on_unreadable(site_path, error)
    sink = Diagnostics()
    folders = dict.fromkeys(folder for path in paths for folder in module_folders(path, sink))
    refused = report_on_paths(sink)
    if site is None:
        return Report(site_report, refused, None)
    examined = {}
    for done, folder in enumerate(folders, 1):
        progress(f"{done} of {len(folders)}: {folder}")
        examined[folder] = examine(folder, site, oracle)
    whole, own = site, presence_of_site(site)
    given = {folder: one.presence for folder, one in examined.items() if one.presence is not None}
    around = modules_around(given, lambda folder: presence_in(folder, whole))
    modules = (report_on(folder, one, own, around) for folder, one in examined.items())
    agreement = None if second is None else agreement_on(oracle.asked.values(), second, progress)
    oracle.keep()
    configuration = report_on_configuration(list(given.values()), own)
    return Report(site_report, (*refused, *modules), site, configuration, agreement)


def verify_site(
    source: Source, oracle: Oracle, blocks: Sequence[Block] = ()
) -> tuple[Site | None, SubjectReport]:
    """The site that `source` declares and what there is to say of it; no site where it declares none."""
    sink, path = Diagnostics(), Path(source.path)
    site = site_of(source, sink)
    if site is None:
        return None, SubjectReport(str(path), path, Conclusion.REJECTED, tuple(sink))
    site = site.with_blocks(blocks)
    settled, findings = _settle((*policy_obligations(site), *joint_policy_obligations(site)), site, oracle)
    problems = (*sink, *_diagnostics(settled, findings))
    claims = Claims.of((*map(told_of, settled), *map(_told, findings)))
    return site, SubjectReport(site.id, path, conclude(problems), problems, claims, settled, findings)


def examine(folder: Path, site: Site, oracle: Oracle) -> Examined:
    """What there is to say of the module in `folder` by itself."""
    sink = Diagnostics()
    loaded = load_ecm(folder, site, sink)
    if loaded is None:
        return Examined(None, tuple(sink))
    ecm = loaded.ecm
    presence, files = presence_of(ecm), read_skill_files(ecm.folder, loaded.code)
    before = (
        *entry_point_obligations(ecm, files),
        *skill_code_obligations(ecm, site, files),
        *runtime_obligations(presence),
    )
    claims = (
        *permission_obligations(ecm, site),
        *safety_obligations(ecm, site),
        *composition_obligations(ecm, site),
        *closed_loop_obligations(ecm, site),
    )
    settled, findings = _settle(claims, site, oracle)
    return Examined(
        presence,
        tuple(sink),
        tuple(map(told_of, before)),
        (*map(told_of, settled), *map(_told, findings)),
        len(settled),
        (*_diagnostics((), findings), *_needless_gates(ecm, findings)),
        (ecm, before, settled, findings),
    )


def presence_in(folder: Path, site: Site) -> Presence | None:
    """What others have to know of the module in `folder`; None where it cannot be read."""
    found = load_ecm(folder, site, Diagnostics())
    return None if found is None else presence_of(found.ecm)


_WORKING: dict[str, tuple[Site, Oracle]] = {}
"""The site and the oracle of a process that was started to prove modules."""


def examine_in_processes(
    folders: Sequence[Path], site: Source, blocks: Sequence[Block], rlimit: int, jobs: int
) -> Iterator[Examined]:
    """What there is to say of each module by itself, without what is in full, found by several processes.

    blocks: operator overrides beside those of the site.  The processes end when the caller stops listening.
    """
    # These modules take 20 ms to import, which few modules need not pay.
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    # Spawned and not forked, as a caller may have threads, whose locks a fork would take along.
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _start_working, (site, blocks, rlimit))
    try:
        yield from pool.map(_work, folders, chunksize=4)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _start_working(source: Source, blocks: Sequence[Block], rlimit: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that is asked to stop tells the others
    site = site_of(source, Diagnostics())
    if site is not None:
        _WORKING["site"] = (site.with_blocks(blocks), Oracle(rlimit))
    # Next to nothing of what proves is in circles, and this process ends with the run: looking for
    # circles takes some hundredths of its time and frees next to nothing.
    gc.disable()


def _work(folder: Path) -> Examined:
    site, oracle = _WORKING["site"]
    return replace(examine(folder, site, oracle), full=None)


def _told(finding: Finding) -> Told:
    one = finding.obligation
    witness = None if finding.witness is None else tuple(finding.witness.lines())
    guard = one.guard if finding.guarded else None
    return Told(one.id, finding.verdict, guard, finding.boundary, witness, diagnostic_of(finding))


def _settle(
    claims: Iterable[Obligation | Settled], site: Site, oracle: Oracle
) -> tuple[tuple[Settled, ...], tuple[Finding, ...]]:
    listed = list(claims)
    open_ = [claim for claim in listed if isinstance(claim, Obligation)]
    settled = tuple(claim for claim in listed if isinstance(claim, Settled))
    return settled, answered(discharge(open_, oracle), site, oracle)


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
