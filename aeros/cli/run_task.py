"""One run of `aeros run`: the agent pursues its instruction, and what is left is told."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from aeros.agent.journal import Event
from aeros.agent.loop import Agent, awake
from aeros.agent.planner import Planner
from aeros.cli.bag import bagged
from aeros.cli.exit_codes import Exit
from aeros.cli.interruptible import Interruptible
from aeros.cli.latest_run import note_run
from aeros.cli.notification import READY, STOPPING, Attended, Notifier
from aeros.cli.page.left import read_left
from aeros.cli.planners import time_for
from aeros.cli.premises import isolated_skills
from aeros.cli.report import written
from aeros.cli.run_plant import Staged, end, staged_plant
from aeros.cli.run_report import TraceWriter, summary
from aeros.runtime.audit import AuditLog, AuditReport, verify_log
from aeros.runtime.audit_checkpoints import Signing, verify_signed
from aeros.runtime.bus.feed import Feed
from aeros.runtime.bus.samples import FILE as SAMPLES
from aeros.runtime.bus.samples import Samples
from aeros.runtime.bus.watched_plant import WatchedPlant
from aeros.runtime.executor import Executor
from aeros.runtime.gate import Gate, GateMode
from aeros.runtime.governor import Command, Governor
from aeros.spec.model import Clause
from aeros.spec.reports import Report

if TYPE_CHECKING:
    from aeros.sim.faults.injector import Happening


class Meant(NamedTuple):
    """What the agent is to do, and under whom.

    proof: of the modules that it does it with.
    goal: in place of the task's own.
    """

    governor: Governor
    proof: Report
    planner: Planner
    goal: Clause | None
    signing: Signing | None


def run_task(staged: Staged, meant: Meant) -> Exit:
    """Have the agent pursue it, tell what came of it, and leave that in the run's folder."""
    began = time.perf_counter()
    arguments, configuration, out = staged.arguments, staged.configuration, staged.out
    log = out / "audit.jsonl"
    with (
        isolated_skills(configuration) as skills,
        bagged(arguments.bag, arguments.mcap, configuration.site) as feed,
        AuditLog(
            log,
            durability=configuration.site.durability,
            signing=meant.signing,
            listener=None if feed is None else feed.record,
        ) as audit,
        TraceWriter(out / "trace.jsonl") as trace,
        Samples(out / SAMPLES, configuration.site) as samples,
        Notifier() as notifier,
        staged_plant(staged, lambda one: trace.tell(_told(one))) as opened,
    ):
        sampled = WatchedPlant(opened, samples)
        plant = sampled if feed is None else WatchedPlant(sampled, feed)
        gate = Gate(configuration, GateMode(arguments.gate))
        with (
            Interruptible(meant.governor) as governed,
            Executor(
                configuration,
                gate,
                plant,
                audit,
                skills,
                attended := Attended(governed, notifier),
                resumed=arguments.resume,
            ) as executor,
        ):
            audit.append("isolation", skills.details())
            with awake(
                arguments.state,
                configuration.site.id,
                executor,
                meant.planner,
                trace.tell,
                arguments.seed,
                within=time_for(arguments, meant.planner),
                purpose=arguments.instruction,
            ) as agent:
                note_run(arguments.state, out)
                attended.on_command = partial(_heed, agent)
                notifier.tell(READY)
                pursue = agent.resume if arguments.resume else agent.run
                report = pursue(arguments.instruction, arguments.timeout, meant.goal)
            notifier.tell(STOPPING)
        simulated = plant.now()
        # Whoever supervises this process ends the plant once all is told, and until then may start another.
        if not arguments.supervised:
            end(opened, arguments.state)
    print(summary(meant.proof, report, arguments.plant, simulated, time.perf_counter() - began))
    audited, sound = _audited(log, meant.signing)
    print(f"audit      {audited.records} records, {sound}")
    if not report.reached:
        print(f"why        aeros why {out}")
    _tell_left(staged, feed, sound)
    if governed.is_interrupted:
        return Exit.INTERRUPTED
    return Exit.PROVED if report.reached and audited.bad_record is None else Exit.REJECTED


def _tell_left(staged: Staged, feed: Feed | None, sound: str) -> None:
    """Write the page, if one is asked for, and print what is left of the run."""
    arguments, out = staged.arguments, staged.out
    if arguments.record is not None and arguments.record.exists():
        print(f"film       {arguments.record}")
    if feed is not None:
        kept = f"bag        {arguments.bag}/" if arguments.mcap is None else f"mcap       {arguments.mcap}"
        print(kept + (f", {feed.lost} not kept: {feed.trouble}" if feed.lost else ""))
    if arguments.report:
        site = staged.configuration.site
        written(read_left(out), out / "report.html", {site.digest: site}, sound)
    print(f"left in    {out}/: " + ", ".join(sorted(path.name for path in out.iterdir())))


def _told(one: Happening) -> Event:
    """What the plant does of itself, as the trace has it."""
    return Event(one.event, one.text, {"fault": one.fault, "opportunity": one.opportunity}, one.time)


def _heed(agent: Agent, command: Command) -> None:
    agent.heed(is_paused=command is Command.PAUSE)


def _audited(log: Path, signing: Signing | None) -> tuple[AuditReport, str]:
    """What a look at the finished log finds, and in words."""
    if signing is None:
        chain, sound = verify_log(log), "chain sound"
    else:
        chain = verify_signed(log, signing.key.public, signing.anchor).chain
        sound = "chain sound, signed" if signing.anchor is None else "chain sound, signed and anchored"
    return chain, sound if chain.sound else f"record {chain.bad_record}: {chain.why}"
