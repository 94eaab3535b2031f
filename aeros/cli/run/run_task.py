"""One run of `aeros run`: the agent pursues its instruction, and the summary is printed."""

from __future__ import annotations

import sys
import time
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from aeros.agent.agent import Agent
from aeros.agent.execution.journal import AgentEvent
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.planning.base import Planner
from aeros.agent.recovery.checkpoint import CheckpointStore, TaskEnd
from aeros.apps.report_page.film_element import find_film
from aeros.apps.report_page.run_data import read_run_data
from aeros.apps.watchdog.resumable_run import delete_run_options, end_plant, end_task
from aeros.apps.why.causal_chain import RunLog
from aeros.cli.arguments import print_warning
from aeros.cli.latest_run import save_latest_run
from aeros.cli.records.dataset import RunDataset
from aeros.cli.records.film import write_film
from aeros.cli.records.report import write_report
from aeros.cli.ros2_options import open_peers, print_bus
from aeros.cli.run.help_question import help_asker
from aeros.cli.run.planners import planning_timeout
from aeros.cli.run.run_plant import PlantSetup, lost_poses, open_run_plant
from aeros.cli.run.run_referee import RunReferee
from aeros.cli.run.run_report import summary
from aeros.cli.terminal.rendering import print_labelled
from aeros.exit_codes import Exit
from aeros.runtime.audit.check import Record
from aeros.runtime.audit.checkpoints import SigningConfiguration, verify_signed
from aeros.runtime.audit.log import AuditLog, AuditReport, verify_log
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.execution.governor import Governor, OperatorCommand
from aeros.runtime.gate.gate import DecisionTally, GateMode
from aeros.session.assembly import SessionSetup, open_agent, open_recorded_plant
from aeros.session.run_governor import RunGovernor
from aeros.session.sd_notify import READY, STOPPING, Notifier
from aeros.session.setup import AUDIT
from aeros.sim.hosting.remote import RemotePlant
from aeros.sim.referee import GoalJudgement
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.verification.reports import Report

if TYPE_CHECKING:
    from aeros.sim.faults.injector import FaultEvent


class RunRequest(NamedTuple):
    """The task of an agent and its governor.

    Attributes:
        governor: Governor of the run.
        proof_report: Verification report of the modules.
        planner: Proposes plans.
        meaning: The requests of the instruction.
        goal: Goal that replaces the task's; None to keep it.
        signing: Signs the audit log; None for no signatures.
        dataset: Gets the run as an episode; None for none.
    """

    governor: Governor
    proof_report: Report
    planner: Planner
    meaning: Understanding
    goal: ActionCondition | None
    signing: SigningConfiguration | None
    dataset: RunDataset | None = None


def run_task(staged: PlantSetup, request: RunRequest) -> Exit:
    """Run the agent until the task ends, print the summary and write the outputs.

    Args:
        staged: Setup of the plant.
        request: Task and governor.

    Returns:
        The exit code.
    """
    began = time.perf_counter()
    arguments, out = staged.arguments, staged.out
    if arguments.resume and (ended := _find_task_end(staged, request)) is not None:
        return _report_past_end(staged, request, ended)
    referee = RunReferee(request.meaning, staged.configuration.modules.values())
    with (
        Notifier() as notifier,
        open_peers(arguments, staged.configuration) as peers,
        open_recorded_plant(
            setup := _setup(staged, request, referee, None if peers is None else peers.bus)
        ) as recorded,
    ):
        referee.plant = recorded.plant
        with (
            RunGovernor(request.governor, notifier) as governor,
            open_agent(setup, recorded if peers is None else peers.with_sensors(recorded), governor) as (
                _,
                agent,
                gate,
            ),
            nullcontext() if peers is None else peers.serve(recorded),
        ):
            if drawn := dict(staged.extras.drawn):
                recorded.audit.append("scene-randomised", {"seed": arguments.seed, "drawn": drawn})
            save_latest_run(arguments.state, out)
            governor.on_command = partial(_apply_command, agent)
            notifier.send(READY)
            agent.ask_for_help = help_asker()
            pursue = agent.resume if arguments.resume else agent.run
            report = pursue(request.meaning, arguments.timeout, request.goal)
        notifier.send(STOPPING)
        simulated = recorded.plant.now()
        judgement = referee.judge(report)
        if judgement is not None:
            recorded.audit.append("goal-judged", judgement.record())
        # An agent that lost its supervisor has stopped; its task and plant can be resumed.
        is_over = False
        if peers is not None:
            print_bus(peers)
        if isinstance(recorded.plant, RemotePlant) and not notifier.is_alone:
            end_plant(recorded.plant, arguments.state)
            is_over = True
    seconds = time.perf_counter() - began
    code = _report_run(staged, request, report, simulated, seconds, recorded.feed, gate.tally, judgement)
    if request.dataset is not None:
        is_true = None if judgement is None else judgement.true
        is_success = report.reached if is_true is None else is_true
        if not request.dataset.add(staged.out, arguments, staged.extras.drawn, is_success=is_success):
            code = Exit.REJECTED
    # Last of all, and by the supervisor if there is one: until then another process can report the end.
    if is_over and not arguments.supervised:
        delete_run_options(arguments.state)
    return Exit.INTERRUPTED if governor.is_interrupted else code


def _setup(
    staged: PlantSetup, request: RunRequest, referee: RunReferee, bus: PublisherFactory | None
) -> SessionSetup:
    """Describe the session that the options select."""
    arguments = staged.arguments
    return SessionSetup(
        configuration=staged.configuration,
        open_plant=lambda observe: open_run_plant(staged, lambda one: observe(_fault_event(one))),
        out=staged.out,
        state=arguments.state,
        warn=print_warning,
        stream=sys.stdout,
        on_event=referee.observe,
        gate_mode=GateMode(arguments.gate),
        signing=request.signing,
        bag=arguments.bag,
        mcap=arguments.mcap,
        keep=tuple(arguments.keep),
        live=arguments.live,
        bus=bus,
        planner=request.planner,
        planning_timeout=planning_timeout(arguments, request.planner),
        seed=arguments.seed,
        purpose=arguments.instruction,
        plant_name=arguments.plant,
        is_resumed=arguments.resume,
        listeners=() if request.dataset is None else (request.dataset.recorder,),
    )


def _find_task_end(staged: PlantSetup, request: RunRequest) -> TaskEnd | None:
    """Return the saved end of the task, if this run's log contains it; repairs and signs the log."""
    ended = CheckpointStore(staged.arguments.state).read_final(staged.arguments.instruction)
    if ended is None:
        return None
    durability = staged.configuration.site.durability
    with AuditLog(staged.out / AUDIT, durability=durability, signing=request.signing) as audit:
        return None if audit.records_since(ended.head) is None else ended


def _report_past_end(staged: PlantSetup, request: RunRequest, ended: TaskEnd) -> Exit:
    """Print the report of a task that ended before its agent could print it."""
    arguments = staged.arguments
    with Notifier() as notifier:
        notifier.send(READY)
        notifier.send(STOPPING)
    print("The task had already ended.")
    code = _report_run(staged, request, ended.report, ended.time, 0.0, None, None, None)
    if not arguments.supervised:
        end_task(arguments.state, arguments.plant_at)
    return code


def _report_run(
    staged: PlantSetup,
    request: RunRequest,
    report: RunReport,
    simulated: float,
    seconds: float,
    feed: BusFeed | None,
    tally: DecisionTally | None,
    judgement: GoalJudgement | None,
) -> Exit:
    """Print the summary and the outputs; return the exit code: a goal that is believed only is no success."""
    out = staged.out
    failures = () if not report.has_failed else _failed_measurements(out / AUDIT)
    plant = staged.arguments.plant
    configuration = staged.configuration
    declared = {name: one for ecm in configuration.modules.values() for name, one in ecm.state.items()}
    declared = {**configuration.site.state, **declared}
    text = summary(request.proof_report, report, plant, simulated, seconds, judgement, failures, declared)
    print(text)
    if tally is not None and GateMode(staged.arguments.gate) is GateMode.CHECKED:
        print_labelled("checked", f"Z3 confirmed {tally.confirmed} of {tally.decided} decisions")
    audited, sound = _check_log(out / AUDIT, request.signing)
    print_labelled("audit", f"{audited.records} records, {sound}")
    is_success = not report.has_failed and not (judgement is not None and judgement.is_false_claim)
    if not is_success:
        print_labelled("why", f"aeros why {out}")
    _report_outputs(staged, feed, sound)
    return Exit.SUCCESS if is_success and audited.bad_record is None else Exit.REJECTED


def _failed_measurements(log: Path) -> tuple[str, ...]:
    """Describe the perceivers and tools that had failed when the run ended."""
    records: list[Record] = []
    verify_log(log, lambda record, own: records.append(record))
    chain = RunLog(records).explain_end().chain
    return tuple(link.text for link in chain if link.is_failed_measurement)


def _report_outputs(staged: PlantSetup, feed: BusFeed | None, sound: str) -> None:
    """Write the report page if requested, and print the outputs of the run."""
    arguments, out = staged.arguments, staged.out
    if lost := lost_poses(staged.viewers):
        print_labelled("poses", f"{lost} lines could not be written: a film of the run has gaps")
    if arguments.film is not None:
        site = staged.configuration.site
        write_film(out, arguments.film, {site.digest: site}, {})
    if feed is not None:
        label, kept = ("bag", f"{arguments.bag}/") if arguments.mcap is None else ("mcap", arguments.mcap)
        lost_messages = f", {feed.lost} messages lost: {feed.trouble}" if feed.lost else ""
        print_labelled(label, f"{kept}{lost_messages}")
    if arguments.report:
        site = staged.configuration.site
        given: Path | None = arguments.film
        film = None if given is None else find_film(given.parent, out, (given.name,))
        write_report(read_run_data(out), out / "report.html", {site.digest: site}, sound, film)
    print_labelled("output", f"{out}/: " + ", ".join(sorted(path.name for path in out.iterdir())))


def _fault_event(one: FaultEvent) -> AgentEvent:
    """Convert an event of the plant to an event of the trace."""
    return AgentEvent(one.event, one.text, {"fault": one.fault, "opportunity": one.opportunity}, one.time)


def _apply_command(agent: Agent, command: OperatorCommand) -> None:
    agent.set_paused(is_paused=command is OperatorCommand.PAUSE)


def _check_log(log: Path, signing: SigningConfiguration | None) -> tuple[AuditReport, str]:
    """Verify the finished log; return the report and a text."""
    if signing is None:
        chain, sound = verify_log(log), "chain sound"
    else:
        chain = verify_signed(log, signing.key.public, *signing.anchors).chain
        sound = "chain sound, signed and anchored" if signing.anchors else "chain sound, signed"
    return chain, sound if chain.is_sound else f"record {chain.bad_record}: {chain.reason}"
