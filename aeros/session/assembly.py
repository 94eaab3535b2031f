"""Assemble a run: plant and recorders, then gate and executor, then the agent.

Experiments, benchmarks and tests may use each of the three steps alone:

1. `open_recorded_plant` opens the plant and everything that outlives the agent: skill processes, bag,
   audit log, trace and samples.
2. `build_executor` joins configuration, gate, plant, audit log and skills.
3. `open_agent` does step 2 for the plant of step 1 and starts the agent that uses it.

Parts are closed in reverse order.  So no step is running when the plant closes, and the plant has stopped
moving when the audit log closes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from aeros.agent.agent import MEMORY_FILE, Agent, open_temporary_agent, start_agent
from aeros.agent.execution.journal import AgentEvent, Observer
from aeros.agent.identity import earlier_sessions
from aeros.agent.planning.base import Planner
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.listened_plant import ListenedPlant, MeasurementListener
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.bus.recording.topic_choice import ChosenTopic
from aeros.runtime.bus.sample_file import FILE as SAMPLES
from aeros.runtime.bus.sample_file import SampleWriter
from aeros.runtime.bus.viewer.link_visuals import LINK_MESHES, filed_visuals
from aeros.runtime.bus.viewer.things import cameras_of_perceivers
from aeros.runtime.execution.executor import Executor
from aeros.runtime.execution.governor import FixedGovernor, Governor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.gate.port import Gate
from aeros.runtime.isolation.run_factory import SkillRunFactory
from aeros.runtime.perception.open_perceiver import open_by_policy, open_in_process
from aeros.runtime.perception.perceiver_run import OpenPerceiver
from aeros.runtime.perception.perceiving_plant import PerceivingPlant
from aeros.runtime.ports import Plant, Runtime, simulated_people, stated_body
from aeros.runtime.records.failed_measurements import RecordEvent, failure_text
from aeros.runtime.skills.in_process_run import OpenRun
from aeros.runtime.tools.tool_plant import ToolPlant
from aeros.session.bag import open_bag, open_live_view, read_link_models
from aeros.session.plant_vocabulary import require_declared_measurements, require_known_actions
from aeros.session.resource_meter import ResourceMeter
from aeros.session.setup import AUDIT, open_isolated_skills
from aeros.session.trace import TRACE, TraceWriter

OpenPlant = Callable[[Observer], AbstractContextManager[Plant]]
"""Opens a plant, given an observer to call with each event of the plant's own, such as a fault."""


@dataclass(frozen=True, kw_only=True)
class SessionSetup:
    """Everything that one session is made of.

    Attributes:
        configuration: Proved modules and the site in force at the start.
        open_plant: Opens the plant, which is closed when the session ends.
        out: An existing folder for audit log, trace and samples.
        state: The agent's state folder; None for a temporary agent that keeps nothing after the session.
        warn: Called with a text if this host isolates skills less than the site wants.
        stream: Stream that events are printed to; None to print nothing.
        on_event: Called with each event after it is written; None for no observer.
        gate_mode: Method of deciding conditions.
        signing: Signs the audit log; None for no signatures.
        bag: A new folder for a ROS 2 bag; None for none.
        mcap: A new MCAP file; None for none.
        keep: Topics to keep in bag or file; none to keep all.
        live: Port of a live view on 127.0.0.1; None for none.
        bus: Bus with live listeners to publish records and measurements on; None for none.
        listeners: Further listeners to measurements.
        planner: Proposes plans; None for the planning rules of the manifest.
        planning_timeout: Seconds for each plan, while the plant's clock runs on; None to plan synchronously.
        seed: Seed of the agent's choices between skills.
        purpose: Text that names the session to other processes that ask for the state folder.
        plant_name: Name of the plant; the agent's results on plants of other names are no evidence.
        is_resumed: True to continue the session in the audit log in `out`.
        wrap_runtime: Wraps the executor for the agent, for example to cancel its steps from another thread.
    """

    configuration: Configuration
    open_plant: OpenPlant
    out: Path
    state: Path | None
    warn: Callable[[str], None]
    stream: TextIO | None = None
    on_event: Observer | None = None
    gate_mode: GateMode = GateMode.CHECKED
    signing: SigningConfiguration | None = None
    bag: Path | None = None
    mcap: Path | None = None
    keep: tuple[ChosenTopic, ...] = ()
    live: int | None = None
    bus: PublisherFactory | None = None
    listeners: Sequence[MeasurementListener] = ()
    planner: Planner | None = None
    planning_timeout: float | None = None
    seed: int = 0
    purpose: str = ""
    plant_name: str = ""
    is_resumed: bool = False
    wrap_runtime: Callable[[Executor], Runtime] = lambda executor: executor


class RecordedPlant(NamedTuple):
    """A plant and the recorders of what it does.

    Attributes:
        plant: The plant as opened, without the recorders.
        audit: Audit log that decisions are written to.
        skills: Factory of skill runs.
        meter: Opens runs of skills and perceivers, and measures what they use.
        observe: Writes an event to the trace and passes it on.
        feed: Feed into the bag or MCAP file; None if neither is written.
        live: Feed to the bus; None if there is none.
        listeners: All listeners to measurements, including the recorders.
    """

    plant: Plant
    audit: AuditLog
    skills: SkillRunFactory
    meter: ResourceMeter
    observe: Observer
    feed: BusFeed | None
    live: BusFeed | None
    listeners: tuple[MeasurementListener, ...]


class AgentSession(NamedTuple):
    """An awake agent, the executor that carries out what it proposes, and the gate that decides it.

    Attributes:
        executor: The executor; it runs the agent's steps.
        agent: The agent, ready for a task.
        gate: The gate at the start; its `tally` counts all decisions.
    """

    executor: Executor
    agent: Agent
    gate: CompiledGate


def build_executor(
    configuration: Configuration,
    plant: Plant,
    audit: AuditLog,
    open_run: OpenRun,
    *,
    gate: Gate | None = None,
    governor: Governor | None = None,
    listeners: Sequence[MeasurementListener] = (),
    open_perceiver: OpenPerceiver = open_in_process,
    observe: Observer | None = None,
    is_resumed: bool = False,
    perceives_all: bool = False,
) -> Executor:
    """Join configuration, gate, plant, audit log, skills and perceivers.

    Args:
        configuration: Modules and site in force.
        plant: Executes allowed actions; the caller closes it.
        audit: Log of every decision; the caller closes it.
        open_run: Opens runs of skills.
        gate: Decides actions; None for a compiled gate under `configuration`.
        governor: Returns the configuration in force; None to keep `configuration`.
        listeners: Called with measurements, also with those of perceivers.
        open_perceiver: Opens runs of perceivers.
        observe: Called with each measurement that failed; None for no observer.
        is_resumed: True to continue the session in the audit log.
        perceives_all: True to run all perceivers, whatever the agent attends to.

    Returns:
        The executor, a context manager.  On exit it ends all running steps and all perceivers.

    Raises:
        AuditError: The log cannot be written, or it is to be resumed and belongs to another site.
    """
    perceiving: PerceivingPlant | None = None
    followed = FixedGovernor(configuration) if governor is None else governor
    record = audit.append if observe is None else _observed_record(audit, plant, observe)
    # Only a governor can bring modules, tools and other words later.
    if governor is not None or any(kind.tool or kind.means for kind in configuration.site.kinds.values()):
        plant = ToolPlant(plant, followed, record)
    if governor is not None or any(
        ecm.perceivers or ecm.definitions or ecm.task_parameters for ecm in configuration.modules.values()
    ):
        plant = perceiving = PerceivingPlant(
            plant, followed, open_perceiver, record, attends_to_all=perceives_all
        )
    return Executor(
        configuration,
        CompiledGate(configuration) if gate is None else gate,
        ListenedPlant(plant, *listeners) if listeners else plant,
        audit,
        open_run,
        governor,
        resumed=is_resumed,
        perception=perceiving,
    )


def _observed_record(audit: AuditLog, plant: Plant, observe: Observer) -> RecordEvent:
    """Return the function that records events of perceivers and tools, and shows failures to the observer."""

    def record(event: str, details: Mapping[str, Any]) -> None:
        audit.append(event, details)
        text = failure_text(event, details)
        if text:
            observe(AgentEvent(event, text, details, plant.now()))

    return record


@contextmanager
def open_recorded_plant(setup: SessionSetup) -> Iterator[RecordedPlant]:
    """Open everything that outlives the agent: skills, bag, audit log, trace, samples and the plant.

    Args:
        setup: Description of the session.

    Yields:
        The plant and its recorders, open until the block ends.

    Raises:
        SkillRefusedError: This host isolates skills less than the site requires.
        BagOutputError: The bag or MCAP file cannot be written.
        AuditError: The audit log cannot be written, or its content is not sound.
        PlantSetupError: The plant cannot be opened, or measures what the site does not declare.
    """
    site = setup.configuration.site
    with (
        open_isolated_skills(setup.configuration, setup.warn) as skills,
        open_bag(setup.bag, setup.mcap, setup.configuration, setup.keep) as feed,
        open_live_view(setup.live, setup.configuration, setup.stream) as live,
        _live_feed(setup) as peers,
        AuditLog(
            setup.out / AUDIT,
            durability=site.durability,
            signing=setup.signing,
            listener=_record_listener(feeds := [one for one in (feed, live, peers) if one is not None]),
        ) as audit,
        TraceWriter(setup.out / TRACE, setup.stream) as trace,
        SampleWriter(
            setup.out / SAMPLES,
            site,
            (meter := ResourceMeter(setup.configuration, skills, open_by_policy(skills))).usage,
        ) as samples,
        setup.open_plant(observe := _observer(setup, trace)) as plant,
    ):
        require_declared_measurements(plant, site)
        require_known_actions(plant, setup.configuration)
        for one in feeds:
            one.locate_people = partial(simulated_people, plant)
            one.body = stated_body(plant)
        listeners: tuple[MeasurementListener, ...] = (samples, *feeds, *setup.listeners)
        yield RecordedPlant(plant, audit, skills, meter, observe, feed, peers, listeners)


def _live_feed(setup: SessionSetup) -> AbstractContextManager[BusFeed | None]:
    if setup.bus is None:
        return nullcontext()
    cameras = cameras_of_perceivers(setup.configuration.modules.values())
    site = setup.configuration.site
    models = read_link_models(site)
    visuals = filed_visuals(setup.out / LINK_MESHES, models)
    return BusFeed(setup.bus, site, is_live=True, cameras=cameras, models=models, visuals=visuals)


def _record_listener(feeds: Sequence[BusFeed]) -> Callable[[bytes], None] | None:
    """Return the function that passes records to all feeds; None if there are none."""
    if not feeds:
        return None

    def on_record(line: bytes) -> None:
        for feed in feeds:
            feed.on_record(line)

    return on_record


@contextmanager
def open_agent(setup: SessionSetup, recorded: RecordedPlant, governor: Governor) -> Iterator[AgentSession]:
    """Put gate and executor before the plant and start the agent; all steps have ended when the block does.

    Args:
        setup: Description of the session.
        recorded: The plant and its recorders.
        governor: Returns the configuration in force and the operator's command.

    Yields:
        The agent and its executor.

    Raises:
        AgentError: Another agent holds the state folder, it is in quarantine, or memory cannot be trusted.
        AuditError: The audit log cannot be written.
    """
    configuration, observe = setup.configuration, recorded.observe
    gate = CompiledGate(configuration, setup.gate_mode)
    with build_executor(
        configuration,
        recorded.plant,
        recorded.audit,
        recorded.meter.open_run,
        gate=gate,
        governor=governor,
        listeners=recorded.listeners,
        open_perceiver=recorded.meter.open_perceiver,
        observe=observe,
        is_resumed=setup.is_resumed,
        # A recording or a client may read every value.
        perceives_all=any((recorded.feed, setup.live is not None, recorded.live, setup.listeners)),
    ) as executor:
        recorded.audit.append("isolation", recorded.skills.audit_details())
        _warn_of_lost_memory(setup)
        name, timeout, planner = configuration.site.id, setup.planning_timeout, setup.planner
        runtime = setup.wrap_runtime(executor)
        opened = (
            open_temporary_agent(name, runtime, planner, observe, setup.seed, timeout)
            if setup.state is None
            else start_agent(
                setup.state,
                name,
                runtime,
                planner,
                observe,
                setup.seed,
                timeout,
                setup.purpose,
                setup.plant_name,
            )
        )
        with opened as agent:
            yield AgentSession(executor, agent, gate)
    tally = gate.tally
    recorded.audit.append(
        "gate-closed", {"mode": gate.mode.value, "decided": tally.decided, "confirmed": tally.confirmed}
    )


def _warn_of_lost_memory(setup: SessionSetup) -> None:
    if setup.state is None or (path := setup.state / MEMORY_FILE).exists():
        return
    if sessions := earlier_sessions(setup.state):
        lost = "session" if sessions == 1 else f"{sessions} sessions"
        setup.warn(
            f"the agent's memory {path} is gone, with what it learned in its earlier {lost}: a new one begins"
        )


def _observer(setup: SessionSetup, trace: TraceWriter) -> Observer:
    on_event = setup.on_event
    if on_event is None:
        return trace.write

    def observe(event: AgentEvent) -> None:
        trace.write(event)
        on_event(event)

    return observe
