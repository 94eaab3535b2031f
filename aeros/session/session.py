"""A session for programs: modules, plant, gate and agent in one context manager."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, wait
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from os import PathLike
from pathlib import Path
from queue import SimpleQueue
from typing import get_args

from aeros.agent.execution.journal import AgentEvent, Observer
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.understand import is_task_name, understand
from aeros.agent.planning.base import Planner
from aeros.files import temporary_folder
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.execution.governor import FixedGovernor, Governor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.ports import Plant
from aeros.runtime.proving import prove_configuration
from aeros.session.argument_checks import (
    as_path,
    as_paths,
    require_members,
    require_one_of,
    require_text,
    require_whole_number,
)
from aeros.session.assembly import AgentSession, SessionSetup, open_agent, open_recorded_plant
from aeros.session.joined_tasks import joined_task, tasks_of
from aeros.session.module_settings import read_module_settings
from aeros.session.plant_factory import PHYSICS_PLANTS, PLANTS, load_run_scene, open_plant
from aeros.session.plant_provider import provided_plants
from aeros.session.reading import read_with_model, refuse_unconfirmed
from aeros.session.rendered_errors import rendered_errors
from aeros.session.robot_thread import RobotThread
from aeros.session.run_governor import RunGovernor
from aeros.session.setup import (
    build_signing,
    create_output_folder,
    find_signing_key,
    open_governor,
)
from aeros.session.skill_gate import GateModeName
from aeros.spec.diagnostics.errors import InternalError, MisuseError
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report

_PLANT_METHODS = ("now", "observe", "plan", "begin", "advance", "halt", "stop", "close")
"""Methods without which an object is no `Plant`; `check_conformance` checks what they do."""


class Session:
    """Robot with one agent, which pursues one instruction after the other; `open_session` makes one.

    The plant is opened with the first instruction, because its task names the scene.  The robot runs in a
    thread of its own.

    Attributes:
        proof: verification report of the site and the modules.
        out: the folder with audit log (`audit.jsonl`), trace and samples.
        report: report of the last run that ended; None before.

    Example:
        >>> with aeros.open_session("ecms/clean_table", seed=7) as session:
        ...     kinds = [event.kind for event in session.events("clean the table")]
        >>> kinds[0], kinds[-1]
        ('task-selected', 'run-ended')
        >>> session.report.reached
        True
    """

    def __init__(
        self,
        proof: Report,
        out: Path,
        governor: RunGovernor,
        make_setup: Callable[[Understanding, Observer], SessionSetup],
        *,
        is_bound_to_scene: bool,
        planner: Planner | None = None,
    ) -> None:
        self.proof = proof
        self.out = out
        self.report: RunReport | None = None
        self._governor = governor
        self._make_setup = make_setup
        self._is_bound_to_scene = is_bound_to_scene
        self._planner = planner
        self._thread: RobotThread[AgentSession] | None = None
        self._scenes: frozenset[str | None] = frozenset()
        self._events: SimpleQueue[AgentEvent | None] = SimpleQueue()
        self._run: Future[RunReport] | None = None
        self._is_closed = False

    def run(self, instruction: str, *, timeout: float | None = None) -> RunReport:
        """Pursue an instruction until its goal is reached or the agent gives up.

        Ctrl-C stops the robot; KeyboardInterrupt is raised once the robot is at rest.

        Args:
            instruction: What to do, in words that tasks of the modules declare (`aeros tasks`).
            timeout: Seconds on the plant's clock after which the task is cancelled; None for never.

        Returns:
            The result: `reached`; `skipped`, True if nothing was done, as the instruction's condition does
            not hold; `reason`, None if it was reached or skipped; `measured`, the variables of the goal and
            those that the task reports; `steps`, the skills that ran; `allowed`, `attenuated` and `denied`,
            numbers of decided actions.

        Raises:
            AgentError: The instruction is not understood whole, or the agent may not start.
            PlantSetupError: The plant cannot be opened.
            SkillRefusedError: This host isolates skill code less than the site requires.
            AuditError: The audit log cannot be written, so nothing moves.
            MisuseError: A run is in progress, the task needs another scene than the plant has, or the
                session is closed.
            InternalError: A fault of AEROS: the run ended without a report.

        Example:
            >>> with aeros.open_session("ecms/", plant="symbolic") as session:
            ...     result = session.run("make dumplings")
            >>> result.reached, result.denied
            (True, 0)
        """
        for _ in self.events(instruction, timeout=timeout):
            pass
        if self.report is None:
            raise InternalError("a run has ended without a report")
        return self.report

    def events(self, instruction: str, *, timeout: float | None = None) -> Iterator[AgentEvent]:
        """Pursue an instruction as `run` does, and yield the agent's events as they happen.

        The run begins with the first `next`, and continues while the caller handles events.  Leaving the loop
        early stops the robot permanently; `report` has the outcome after the last event.

        Args:
            instruction: What to do, in words that tasks of the modules declare (`aeros tasks`).
            timeout: Seconds on the plant's clock after which the task is cancelled; None for never.

        Yields:
            Events: `kind`, `text` for people (may be empty), `details` as JSON values, `time` in plant
            seconds.

        Raises:
            Exception: All exceptions of `run`.

        Example:
            >>> with aeros.open_session("ecms/clean_table") as session:
            ...     for event in session.events("clean the table"):
            ...         if event.kind == "plan-accepted":
            ...             print(len(event.details["steps"]))
            3
        """
        thread, meaning = self._opened(instruction)
        events = self._events = SimpleQueue()
        run = self._run = thread.call(lambda session: session.agent.run(meaning, timeout))
        run.add_done_callback(lambda _: events.put(None))
        try:
            while (event := events.get()) is not None:
                yield event
            with rendered_errors():
                self.report = run.result()
        finally:
            self._stop_and_wait()

    def stop(self) -> None:
        """Stop the robot permanently: all motion comes to rest, and no later run starts an action.

        Any thread may call it.
        """
        self._governor.interrupt()

    def close(self) -> None:
        """Stop a run in progress and close plant, agent and audit log; safe to call twice.

        Raises:
            AuditError: The end of the audit log cannot be written.
        """
        self._is_closed = True
        self._stop_and_wait()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.close()

    def _stop_and_wait(self) -> None:
        run = self._run
        if run is not None and not run.done():
            self.stop()
            wait([run])

    def _opened(self, instruction: str) -> tuple[RobotThread[AgentSession], Understanding]:
        """Return the robot's thread, opened if this is the first task, and the instruction's meaning.

        Raises:
            MisuseError: A run is under way, the session is closed, or the task takes place in another scene.
        """
        if self._is_closed:
            raise MisuseError("the session is closed; run instructions in the block of `open_session`")
        if self._run is not None and not self._run.done():
            raise MisuseError("a run is under way: take its events to the end, or call `stop`")
        require_text("instruction", instruction)
        with rendered_errors():
            configuration = self._governor.configuration()[1]
            meaning = self._find_meaning(instruction, configuration)
            tasks = tasks_of(meaning, configuration)
            if self._thread is None:
                setup = self._make_setup(meaning, lambda event: self._events.put(event))
                self._scenes = frozenset(task.scene for task in tasks)
                self._thread = RobotThread(lambda: _open_parts(setup, self._governor))
        elsewhere = [task for task in tasks if task.scene not in self._scenes]
        if self._is_bound_to_scene and elsewhere:
            there = ", ".join(f"`{scene}`" for scene in sorted(map(str, self._scenes)))
            raise MisuseError(
                f"`{elsewhere[0].id}` takes place in `{elsewhere[0].scene}`, and the plant has only {there}: "
                "open another session, or begin one with an instruction that asks for both"
            )
        return self._thread, meaning

    def _find_meaning(self, instruction: str, configuration: Configuration) -> Understanding:
        """Understand an instruction; the language model of a planner has to agree."""
        endpoint = getattr(self._planner, "endpoint", None)
        if endpoint is None or is_task_name(instruction, configuration.modules):
            return understand(instruction, configuration.modules)
        timeout_s = getattr(self._planner, "timeout_s", float(configuration.site.limits.planning))
        meaning, _ = read_with_model(
            lambda: understand(instruction, configuration.modules),
            instruction,
            configuration,
            endpoint,
            timeout_s,
            refuse_unconfirmed,
        )
        return meaning


@contextmanager
def _open_parts(setup: SessionSetup, governor: Governor) -> Iterator[AgentSession]:
    with open_recorded_plant(setup) as recorded, open_agent(setup, recorded, governor) as session:
        yield session


@contextmanager
def open_session(
    modules: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    plant: str | Plant = "symbolic",
    site: str | PathLike[str] | None = None,
    seed: int = 0,
    planner: Planner | None = None,
    gate: GateModeName = "checked",
    out: str | PathLike[str] | None = None,
    state: str | PathLike[str] | None = None,
    bindings: Mapping[str, str] | None = None,
    parameters: Mapping[str, str] | None = None,
    ideal_sensors: bool = False,
) -> Iterator[Session]:
    """Prove modules and open a robot that runs them, every action decided by the gate.

    Args:
        modules: A module's folder or a folder of modules, or several of these; each module has a current
            `ecm.lock` (`aeros verify`).
        plant: `symbolic` (declared outcomes), `kinematic`, `physics`, `mujoco`, the name of a plant that an
            installed distribution provides, or your own `Plant`, which you close.
        site: The site file; None for the policy in force in `state`, or else the reference site, a Panda
            cell.
        seed: Seed of all random numbers, 0 or more.
        planner: Proposes plans; None for the planning rules of the manifests. The model of an `LlmPlanner`
            reads instructions, too, and has to agree with the grammar.
        gate: Method of deciding conditions: `compiled`; `z3`; or `checked`, both.
        out: A new folder for audit log, trace and samples; None for one that is deleted at the end.
        state: The robot's state folder: the agent's identity and memory are in it, and every command of the
            operator on it governs the session (`aeros block`, `deactivate`, `policy`, `pause`, `stop`).
            None for a temporary agent that keeps nothing after the session and that no command reaches.
        bindings: The site's name for what a module needs, by `MODULE.NEED`, as `--bind` gives it.
        parameters: Values of modules' parameters, with their units, by `MODULE.PARAMETER`, as `--set` does.
        ideal_sensors: Simulate sensors without the errors that the site declares.

    Yields:
        The session.  At the end of the block all motion is stopped and everything is closed.

    Raises:
        UserError: A file is rejected, a claim is refuted, or a certificate is missing or not current; its
            text has file, line, cause and help.
        PlantSetupError: `out` is not empty or cannot be written.
        MisuseError: There is no such plant or gate mode, or an argument has a wrong type.

    Example:
        >>> with aeros.open_session("ecms/", plant="symbolic") as session:
        ...     result = session.run("make dumplings")
        >>> result.goal, result.reached
        ('dumplings_cooked >= count', True)
    """
    name = plant if isinstance(plant, str) else None
    if name is None:
        require_members("plant", plant, _PLANT_METHODS, "Plant")
    else:
        require_one_of("plant", name, (*PLANTS, *provided_plants()))
    require_one_of("gate mode", gate, get_args(GateModeName))
    require_whole_number("seed", seed)
    ecms, path = as_paths("modules", modules), None if site is None else as_path("site", site)
    robot = None if state is None else as_path("state", state)
    output = None if out is None else as_path("out", out)
    settings = read_module_settings(bindings, parameters)
    with ExitStack() as stack:
        with rendered_errors():
            governor: Governor
            if robot is None:
                configuration, proof = prove_configuration(
                    ecms, path or reference_site_path(), certified=True, settings=settings
                )
                governor = FixedGovernor(configuration)
            else:
                steered, configuration, proof = open_governor(
                    robot, ecms, path, configurations=settings.configurations
                )
                stack.enter_context(steered)
                for reason in steered.withheld.values():
                    warnings.warn(f"{reason} on this robot", RuntimeWarning, stacklevel=3)
                governor = steered
        folder = create_output_folder(output or Path(stack.enter_context(temporary_folder())), "")

        def make_setup(meaning: Understanding, observe: Observer) -> SessionSetup:
            return SessionSetup(
                configuration=configuration,
                open_plant=lambda _: _plant_for(plant, meaning),
                out=folder,
                state=robot,
                warn=lambda text: warnings.warn(text, RuntimeWarning, stacklevel=2),
                on_event=observe,
                gate_mode=GateMode(gate),
                signing=None if robot is None else _signing(robot, folder),
                planner=planner,
                seed=seed,
                plant_name=plant if isinstance(plant, str) else type(plant).__qualname__,
            )

        def _plant_for(given: str | Plant, meaning: Understanding) -> AbstractContextManager[Plant]:
            if not isinstance(given, str):
                return nullcontext(given)
            tasks = tasks_of(meaning, configuration)
            scene = load_run_scene(given, None, configuration, tasks, seed)
            return open_plant(
                given, configuration, joined_task(tasks), seed, scene=scene, ideal_sensors=ideal_sensors
            )

        session = Session(
            proof,
            folder,
            RunGovernor(governor),
            make_setup,
            is_bound_to_scene=name in (*PHYSICS_PLANTS, "kinematic"),
            planner=planner,
        )
        stack.callback(session.close)
        yield session


def _signing(state: Path, out: Path) -> SigningConfiguration:
    return build_signing(find_signing_key(state), state, out)
