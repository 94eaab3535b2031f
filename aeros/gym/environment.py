"""An environment of Gymnasium in which an agent chooses skills, and the gate decides their actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from os import PathLike
from typing import Any, Final, SupportsFloat, cast, get_args

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from aeros.agent.execution.supervisor import start_obstacle
from aeros.agent.world.values import to_exact
from aeros.agent.world.world import WorldModel
from aeros.gym.cell import EpisodeInCell, SkillAttempt, TaskCell
from aeros.gym.choices import (
    ActionSpaceName,
    Bounds,
    Decoder,
    RequestDecoder,
    SkillChoice,
    SkillDecoder,
    skill_choices,
)
from aeros.gym.observations import GymObservation, ObservationEncoder
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.ports import StepStatus, newest_pictures
from aeros.session.argument_checks import as_path, as_paths, require_one_of, require_text
from aeros.session.module_settings import read_module_settings
from aeros.session.plant_factory import PLANTS
from aeros.session.plant_provider import provided_plants
from aeros.session.skill_gate import GateModeName
from aeros.sim.referee import GoalJudgement
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.scene import SceneCamera
from aeros.spec.text.discovery import reference_site_path

_MAX_SEED: Final = 2**31 - 1
"""Bound of the seeds that an environment draws by itself for episodes after the first."""


class TaskEnvironment(gymnasium.Env[GymObservation, Any]):
    """Environment in which an action runs one skill, and the reward is the task's goal, by truth.

    A step takes as long as the skill does, on the plant's clock.  The gate is on: an action that it denies
    ends the skill, and `info` names the rule.  A skill whose precondition is not measured to hold does not
    start, and the state stays as it is; `info["action_mask"]` has 1 for each skill that may start.

    The reward is 1 in the step after which the goal is true in the simulator, as its referee sees it, and
    the episode ends; otherwise it is 0.  Plants without bodies know no truth: there, and where the scene does
    not define the goal's truth, the measured goal counts, and `info["is_refereed"]` is False.

    Args:
        modules: a module's folder or a folder of modules, or several of these; each has a current `ecm.lock`.
        instruction: asks for one task, in words or as `MODULE.TASK KEY=VALUE`; None for the task that has
            the name of its module, or the only one.
        plant: `symbolic`, `kinematic`, `physics` (PyBullet), `mujoco`, or that of another distribution; none
            that runs in real time, as a robot does.
        actions: `skills`, `skills-with-inputs` or `requests`.
        skill: `MODULE.SKILL` in whose name single actions are asked for; only with `requests`.
        bounds: least and greatest value (SI) of the numbers that an action chooses, by `MODULE.SKILL.INPUT`
            or `KIND.PARAMETER`; None for the declared ranges.
        site: the site file; None for the reference site, a Panda cell.
        gate: `compiled`; `z3`; or `checked`, both.
        out: a folder that gets the audit log of each episode; None to keep none.
        bindings: as of `open_session`.
        parameters: as of `open_session`.
        ideal_sensors: sensors without the errors that the site declares.
        randomise: draw masses, friction, colours, light, places and sensor errors for each episode, from the
            ranges in scene files; `info` of `reset` has what was `drawn`.
        camera: the camera whose newest picture `render` returns; None for the first one.
        render_mode: `rgb_array`, on plants with cameras; None to render nothing.

    Attributes:
        observation_names: names of the numbers of an observation, in order.
        skill_names: `MODULE.SKILL` of each choice, in order.

    Raises:
        UserError: a file is rejected, a claim is refuted, or a lock is missing or not current.
        AgentError: the instruction is not understood whole.
        PlantSetupError: the plant is not installed.
        MisuseError: an argument is none, there are several tasks and no instruction, the plant runs in real
            time, or it has no such camera.
    """

    # A picture shows the end of a skill, so a film of an episode is a slide show.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012

    def __init__(
        self,
        modules: str | PathLike[str] | Sequence[str | PathLike[str]],
        instruction: str | None = None,
        *,
        plant: str = "symbolic",
        actions: ActionSpaceName = "skills",
        skill: str | None = None,
        bounds: Bounds | None = None,
        site: str | PathLike[str] | None = None,
        gate: GateModeName = "compiled",
        out: str | PathLike[str] | None = None,
        bindings: Mapping[str, str] | None = None,
        parameters: Mapping[str, str] | None = None,
        ideal_sensors: bool = False,
        randomise: bool = False,
        camera: str | None = None,
        render_mode: str | None = None,
    ) -> None:
        require_one_of("plant", plant, (*PLANTS, *provided_plants()))
        require_one_of("action space", actions, get_args(ActionSpaceName))
        require_one_of("gate mode", gate, get_args(GateModeName))
        if instruction is not None:
            require_text("instruction", instruction)
        self._cell = TaskCell(
            as_paths("modules", modules),
            reference_site_path() if site is None else as_path("site", site),
            read_module_settings(bindings, parameters),
            instruction,
            plant,
            GateMode(gate),
            None if out is None else as_path("out", out),
            ideal_sensors=ideal_sensors,
            randomise=randomise,
        )
        try:
            cameras = {} if self._cell.scene is None or plant == "kinematic" else self._cell.scene.cameras
            self._camera = _require_camera(camera, cameras, render_mode)
            self._camera_of = cameras
            if not cameras:
                self.metadata = {"render_modes": []}
            self.render_mode = render_mode
            configuration, routed = self._cell.configuration, self._cell.routed
            choices = skill_choices(configuration.modules, routed.module, routed.task)
            self._decoder = _make_decoder(choices, actions, skill, bounds or {}, configuration.site.kinds)
            self._encoder = ObservationEncoder(configuration.site.state)
        except BaseException:
            self._cell.close()
            raise
        self.action_space = self._decoder.space
        self.observation_space = cast("spaces.Space[GymObservation]", self._encoder.space)
        self.observation_names = self._encoder.names
        self.skill_names = tuple(one.name for one in self._decoder.choices)
        self._open = ExitStack()
        self._episode: EpisodeInCell | None = None
        self._world: WorldModel | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[GymObservation, dict[str, Any]]:
        """Begin an episode on a fresh plant.

        Args:
            seed: seed of the plant's random numbers, as of `aeros run --seed`; None to draw one.
            options: must be empty: there are none.

        Returns:
            The observation; and `info` with `time`, `seed` and `action_mask`, and `drawn` if it is
            randomised.

        Raises:
            MisuseError: an option is unknown, or the plant runs in real time.
            PlantSetupError: the plant cannot be opened.
        """
        super().reset(seed=seed)
        if options:
            raise MisuseError(f"there is no option `{next(iter(options))}`: `reset` takes a seed only")
        of_plant = int(self.np_random.integers(_MAX_SEED)) if seed is None else seed
        self._end_episode()
        self._episode = self._open.enter_context(self._cell.open_episode(of_plant))
        self._world = self._episode.world()
        info = {"seed": of_plant, "time": self._world.time, "action_mask": self._action_mask(self._world)}
        if self._episode.drawn:
            info["drawn"] = dict(self._episode.drawn)
        return self._encoder.encode(self._world), info

    def step(self, action: Any) -> tuple[GymObservation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Run the chosen skill to its end.

        Args:
            action: a member of the action space.

        Returns:
            Observation, reward, True if the goal is reached, False (the environment truncates nothing), and
            `info`; `docs/how-to/gym.md` lists its keys.

        Raises:
            MisuseError: `reset` was not called, or the action is not in the space.
            AuditError: the audit log cannot be written, so nothing moves.
        """
        if self._episode is None or self._world is None:
            raise MisuseError("there is no episode; call `reset` before `step`")
        if not self.action_space.contains(action):
            raise MisuseError(f"the action {action!r} is not in {self.action_space}")
        choice, inputs, request = self._decoder.decode(action)
        attempt = self._episode.run(choice.module, choice.skill, inputs, self._world, request)
        self._world = self._episode.world()
        judgement = self._episode.judge(self._world)
        is_refereed = judgement.true is not None
        is_reached = judgement.true is True if is_refereed else judgement.believed
        info = {
            "time": self._world.time,
            "action_mask": self._action_mask(self._world),
            **_attempt_info(choice, attempt, is_request=request is not None),
            **_judgement_info(judgement),
            "is_success": is_reached,
        }
        return self._encoder.encode(self._world), float(is_reached), is_reached, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the newest picture of the chosen camera.

        Returns:
            Array of shape (height, width, 3), black until the camera has taken a picture; None without a
            render mode.
        """
        if self.render_mode is None or self._camera is None:
            return None
        pictures = {} if self._episode is None else newest_pictures(self._episode.plant)
        picture = pictures.get(self._camera)
        if picture is None:
            camera = self._camera_of[self._camera]
            return np.zeros((camera.height, camera.width, 3), dtype=np.uint8)
        pixels = np.frombuffer(picture.rgb, dtype=np.uint8)
        return pixels.reshape(picture.height, picture.width, 3).copy()

    def close(self) -> None:
        """End the episode and the processes that run skills; safe to call twice."""
        self._end_episode()
        self._cell.close()

    def _end_episode(self) -> None:
        self._episode, self._world = None, None
        self._open.close()

    def _action_mask(self, world: WorldModel) -> NDArray[np.int8]:
        """Return 1 for each skill that may start with its inputs of rule or default."""
        return np.array([_can_start(one, world) for one in self._decoder.choices], dtype=np.int8)


def _make_decoder(
    choices: Sequence[SkillChoice],
    actions: ActionSpaceName,
    skill: str | None,
    bounds: Bounds,
    kinds: Mapping[str, ActionKind],
) -> Decoder:
    if actions != "requests":
        if skill is not None:
            raise MisuseError('`skill` is for `actions="requests"`')
        return SkillDecoder(choices, bounds, with_inputs=actions == "skills-with-inputs")
    require_one_of("skill", skill, tuple(one.name for one in choices))
    return RequestDecoder(next(one for one in choices if one.name == skill), kinds, bounds)


def _can_start(choice: SkillChoice, world: WorldModel) -> bool:
    declared = choice.skill.inputs
    if choice.inputs.keys() != declared.keys():
        return choice.skill.precondition is None
    exact = {one.name: to_exact(one, choice.inputs[name]) for name, one in declared.items()}
    return start_obstacle(choice.module, choice.skill, world, exact) is None


def _require_camera(
    name: str | None, cameras: Mapping[str, SceneCamera], render_mode: str | None
) -> str | None:
    if render_mode is None and name is None:
        return None
    if render_mode not in (None, "rgb_array"):
        raise MisuseError(f"there is no render mode `{render_mode}`; there is `rgb_array`")
    if not cameras:
        raise MisuseError("this plant has no cameras: use `physics` or `mujoco`, or no render mode")
    chosen = next(iter(cameras)) if name is None else name
    require_one_of("camera", chosen, tuple(cameras))
    return chosen


def _attempt_info(choice: SkillChoice, attempt: SkillAttempt, *, is_request: bool) -> dict[str, Any]:
    """Tell of a step; a single action in a skill's name has none of the outcomes that the skill declares."""
    result, assessment = attempt.result, attempt.assessment
    has_ended = result.status is StepStatus.FINISHED
    has_failed, reason = (
        (not has_ended, result.reason) if is_request else (assessment.failed, assessment.reason)
    )
    return {
        "skill": choice.name,
        "status": result.status.value,
        "outcome": "" if is_request else assessment.outcome or "",
        "has_failed": has_failed,
        "reason": reason,
        "allowed": result.allowed,
        "attenuated": result.attenuated,
        "denied": result.denied,
        "objections": [_objection(one) for one in attempt.objections],
    }


def _objection(details: Mapping[str, Any]) -> dict[str, Any]:
    """Tell of one action that was denied or attenuated: the verdict, what was asked, and each rule."""
    return {
        "verdict": details["verdict"],
        "asked": details["asked"],
        "decided": details["decided"],
        "time": details["time"],
        "rules": [rule for _, rule, _ in details["reasons"]],
        "reasons": [text for _, _, text in details["reasons"]],
    }


def _judgement_info(judgement: GoalJudgement) -> dict[str, Any]:
    return {"is_believed": judgement.believed, "is_refereed": judgement.true is not None}
