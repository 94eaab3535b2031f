"""A proved cell of one task, in which episodes run: plant, gate and executor are new in each of them."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from aeros.agent.execution.supervisor import StepAssessment, assess_step, start_obstacle
from aeros.agent.instructions.meaning import single_errand
from aeros.agent.instructions.understand import understand
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.world.values import CachingConverter, to_exact
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.files import make_private_folder, temporary_folder
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import decode_value
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.perception.open_perceiver import open_by_policy
from aeros.runtime.ports import Plant, StepRequest, StepResult, StepStatus
from aeros.runtime.proving import prove_configuration
from aeros.runtime.skills.in_process_run import OpenRun, SkillRunProtocol, SkillRunResult
from aeros.session.assembly import build_executor
from aeros.session.plant_factory import PLANTS, PlantSetupError, draw_scene, load_run_scene, open_plant
from aeros.session.plant_provider import PlantProviderError, load_provider
from aeros.session.plant_vocabulary import require_declared_measurements, require_known_actions
from aeros.session.rendered_errors import rendered_errors
from aeros.session.setup import AUDIT, open_isolated_skills
from aeros.sim.referee import GoalJudgement, judge_goal, truth_of
from aeros.skill import Action, Observation
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.policy import Durability
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import arguments_in_force

_DECISION: Final = b'"event":"decision"'

_ALLOWED: Final = f'"verdict":"{DecisionKind.ALLOW.value}"'.encode()


class SkillAttempt(NamedTuple):
    """One skill that was run, or that could not start.

    Attributes:
        result: the result that the runtime gives.
        assessment: the measured outcome.
        objections: details of the decisions that were no plain permission, as the audit log has them.
    """

    result: StepResult
    assessment: StepAssessment
    objections: tuple[Mapping[str, Any], ...]


class _SingleRequest:
    """Run of a skill whose code is replaced by one action; implements `SkillRunProtocol`."""

    def __init__(self, action: Action) -> None:
        self._left = [action]

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        """Implement `SkillRunProtocol.resume`."""
        if denial:
            return SkillRunResult(StepStatus.DENIED, denial)
        return self._left.pop() if self._left else SkillRunResult(StepStatus.FINISHED, "")

    def close(self) -> str | None:
        """Implement `SkillRunProtocol.close`."""
        return None


class ObjectionListener:
    """Listener of an audit log that keeps the decisions to deny or to attenuate an action.

    Attributes:
        found: their details, until they are cleared.
    """

    def __init__(self) -> None:
        self.found: list[Mapping[str, Any]] = []

    def __call__(self, line: bytes) -> None:
        """Take note of a record: a line of canonical JSON, in which strings hold no plain quotes."""
        if _DECISION in line and _ALLOWED not in line:
            self.found.append(decode_value(json.loads(line)["details"]))


class RequestingRuns:
    """Opens runs of skills, or runs of one action in the name of a skill; implements `OpenRun`.

    The gate knows the skill as the one who asks, so its envelope and permissions bind the action.

    Args:
        open_run: opens runs of the skills' own code.
    """

    def __init__(self, open_run: OpenRun) -> None:
        self._open_run = open_run
        self._request: Action | None = None

    @contextmanager
    def requesting(self, action: Action | None) -> Iterator[None]:
        """Replace the code of the skills that start in the block.

        Args:
            action: the action; None to replace nothing.
        """
        self._request = action
        try:
            yield
        finally:
            self._request = None

    def __call__(self, site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        """Implement `OpenRun`."""
        if self._request is not None:
            return _SingleRequest(self._request)
        return self._open_run(site, ecm, skill, inputs)


class EpisodeInCell:
    """One try of the task on a fresh plant.

    Args:
        cell: the cell.
        executor: runs skills.
        plant: the plant itself, for its truth and its pictures.
        runs: opens the runs of the executor's steps.
        objections: listens to the executor's audit log.
        drawn: what was drawn for its scene, by name; empty unless it is randomised.
    """

    def __init__(
        self,
        cell: TaskCell,
        executor: Executor,
        plant: Plant,
        runs: RequestingRuns,
        objections: ObjectionListener,
        drawn: Mapping[str, Any],
    ) -> None:
        self.plant = plant
        self.drawn = drawn
        self._objections = objections.found
        self._runs = runs
        self._cell = cell
        self._executor = executor
        self._convert = CachingConverter()

    def world(self) -> WorldModel:
        """Measure the state.

        Returns:
            The known values.
        """
        executor = self._executor
        return world_from_readings(executor.site.state, executor.observe(), executor.now(), self._convert)

    def run(
        self,
        module: str,
        skill: Skill,
        inputs: Mapping[str, Any],
        before: WorldModel,
        request: Action | None = None,
    ) -> SkillAttempt:
        """Run a skill to its end, if its precondition is measured to hold.

        Args:
            module: id of its module.
            skill: the skill.
            inputs: its inputs, SI.
            before: the state measured now.
            request: the only action of the step, asked for in the name of the skill in place of its code;
                None to run the code.

        Returns:
            Result, outcome and objections of the gate.
        """
        exact = {one.name: to_exact(one, inputs.get(name)) for name, one in skill.inputs.items()}
        obstacle = start_obstacle(module, skill, before, exact)
        if obstacle is not None:
            result = StepResult(StepStatus.REFUSED, str(obstacle), causes=(obstacle,))
            return SkillAttempt(result, assess_step(module, skill, result, before, before.predicates), ())
        self._objections.clear()
        with self._runs.requesting(request):
            result = self._executor.run_step(StepRequest(module, skill.id, inputs))
        return SkillAttempt(
            result,
            assess_step(module, skill, result, self.world(), before.predicates),
            tuple(self._objections),
        )

    def judge(self, world: WorldModel) -> GoalJudgement:
        """Judge the task's goal by the truth of the plant.

        Args:
            world: the measured state.

        Returns:
            Belief and truth.
        """
        routed = self._cell.routed
        believed = world.truth_by_known_values(routed.task.goal) is True
        arguments = arguments_in_force(self._cell.configuration.modules.values(), routed.variables)
        return judge_goal(routed.task.goal, believed, truth_of(self.plant), routed.module, arguments)


class TaskCell:
    """Proved modules and the task; the processes that run their skills serve all episodes.

    Args:
        modules: folders of modules, each with a current `ecm.lock`.
        site: the site file.
        settings: settings of modules.
        instruction: asks for one task; None for the one that has the name of its module, or the only one.
        plant: name of a plant.
        gate: method of deciding conditions.
        out: a folder for the audit log of each episode; None to keep the present one only, until `close`.
        ideal_sensors: as of `open_session`.
        randomise: True to draw a scene for each episode from the ranges in scene files.

    Attributes:
        configuration: proved modules and the site.
        routed: the task with its arguments.
        scene: the scene; None on the symbolic plant.

    Raises:
        UserError: a file is rejected, a claim is refuted, or a lock is missing or not current.
        AgentError: the instruction is not understood whole.
        MisuseError: the plant runs in real time, as a robot does.
        PlantSetupError: the plant is not installed.
        SkillRefusedError: this host isolates skill code less than the site requires.
    """

    def __init__(
        self,
        modules: Sequence[Path],
        site: Path,
        settings: OperatorSettings,
        instruction: str | None,
        plant: str,
        gate: GateMode,
        out: Path | None,
        *,
        ideal_sensors: bool,
        randomise: bool,
    ) -> None:
        if plant not in PLANTS:
            _require_simulated(plant, runs_in_real_time=_provider_runs_in_real_time(plant))
        self._plant, self._ideal_sensors, self._randomise = plant, ideal_sensors, randomise
        self._out, self._episodes = out, 0
        with rendered_errors(), ExitStack() as stack:
            self.configuration, _ = prove_configuration(modules, site, certified=True, settings=settings)
            self.routed = _task_of(instruction, self.configuration.modules)
            self._task = self.routed.task_at_start
            self.scene = load_run_scene(plant, None, self.configuration, [self._task], 0)
            if randomise:
                draw_scene(plant, self.scene, 0)  # says what is missing before the first episode
            self._gate = CompiledGate(self.configuration, gate)
            self._skills = stack.enter_context(open_isolated_skills(self.configuration, _warn))
            self._temporary = stack.enter_context(temporary_folder())
            self._stack = stack.pop_all()

    @contextmanager
    def open_episode(self, seed: int) -> Iterator[EpisodeInCell]:
        """Open a fresh plant at the start of the task.

        Args:
            seed: seed of all random numbers of the plant.

        Yields:
            The episode.

        Raises:
            MisuseError: the plant runs in real time, as a robot does.
            PlantSetupError: the plant cannot be opened, or it does not measure or do what the site declares.
        """
        configuration = self.configuration
        scene, drawn = draw_scene(self._plant, self.scene, seed) if self._randomise else (self.scene, {})
        with (
            rendered_errors(),
            open_plant(
                self._plant,
                configuration,
                self._task,
                seed,
                scene=scene,
                ideal_sensors=self._ideal_sensors,
            ) as plant,
        ):
            _require_simulated(self._plant, runs_in_real_time=getattr(plant, "runs_in_real_time", False))
            require_declared_measurements(plant, configuration.site)
            require_known_actions(plant, configuration)
            runs, objections = RequestingRuns(self._skills), ObjectionListener()
            with (
                # A simulator's log may lose its end with the power; nothing moved that it would have to tell.
                AuditLog(self._new_log(), durability=Durability.BATCHED, listener=objections) as audit,
                build_executor(
                    configuration,
                    plant,
                    audit,
                    runs,
                    gate=self._gate,
                    open_perceiver=open_by_policy(self._skills),
                ) as executor,
            ):
                audit.append("isolation", self._skills.audit_details())
                if drawn:
                    audit.append("scene-randomised", {"seed": seed, "drawn": dict(drawn)})
                executor.attend(frozenset(configuration.modules))
                executor.set_parameters(self.routed.variables)
                yield EpisodeInCell(self, executor, plant, runs, objections, drawn)

    def close(self) -> None:
        """End the processes that run skills, and delete temporary logs; safe to call twice."""
        self._stack.close()

    def _new_log(self) -> Path:
        """Return the path of a new audit log."""
        if self._out is None:
            path = self._temporary / AUDIT
            path.unlink(missing_ok=True)
            return path
        while (folder := self._out / f"episode-{self._episodes:06d}").exists():
            self._episodes += 1
        make_private_folder(folder)
        return folder / AUDIT


def _provider_runs_in_real_time(plant: str) -> bool:
    """Return what the provider of a plant says about it.

    Raises:
        PlantSetupError: no distribution provides it, or it cannot be imported.
    """
    try:
        return load_provider(plant, PLANTS).runs_in_real_time
    except PlantProviderError as failure:
        raise PlantSetupError(str(failure)) from failure


def _require_simulated(plant: str, *, runs_in_real_time: bool) -> None:
    """Require a plant that waits for its monitor.

    Raises:
        MisuseError: it runs in real time.
    """
    if runs_in_real_time:
        raise MisuseError(
            f"the plant `{plant}` runs in real time, as a robot does: an environment moves simulated plants "
            "alone, as it has no operator who stops or pauses it, and its log may lose its end; use "
            "`aeros run` or `aeros.open_session` for a robot (docs/how-to/gym.md)"
        )


def _task_of(instruction: str | None, modules: Mapping[str, Ecm]) -> RoutedTask:
    """Find the task that is asked for.

    Raises:
        AgentError: the instruction is not understood whole.
        MisuseError: there is no instruction, and more than one task may be meant.
    """
    if instruction is None:
        tasks = [(module, task) for module, ecm in modules.items() for task in ecm.tasks]
        named = [one for one in tasks if one[0] == one[1]]
        candidates = named or tasks
        if len(candidates) != 1:
            listed = ", ".join(f"`{module}.{task}`" for module, task in tasks)
            raise MisuseError(f"give an `instruction`, such as the name of a task: {listed}")
        instruction = ".".join(candidates[0])
    return single_errand(understand(instruction, modules))


def _warn(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=2)
