"""What is asked of a skill, and what it gives at its end, against what is active and what it declares."""

from __future__ import annotations

from aeros.runtime.execution.hold_condition import hold_condition_for
from aeros.runtime.execution.inputs import InputError, check_inputs, check_outputs
from aeros.runtime.execution.resources import ResourceQueue
from aeros.runtime.execution.step import ActiveStep, required_resources
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller
from aeros.runtime.ports import StepRequest, StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import OpenRun, SkillRunResult
from aeros.spec.model.model import Ecm, Skill


class StepRefusedError(Exception):
    """The step never starts; the message says why."""


def prepare_step(
    request: StepRequest, configuration: Configuration, resources: ResourceQueue, open_run: OpenRun
) -> ActiveStep:
    """The step that is asked for, ready to start; raises `StepRefusedError`."""
    ecm, skill = _find_skill(request, configuration)
    lacking = resources.never_available(required_resources(skill))
    if lacking is not None:
        raise StepRefusedError(f"this site has no `{lacking}`")
    try:
        inputs = check_inputs(skill.inputs, request.inputs)
        run = open_run(configuration.site, ecm, skill, inputs)
    except (InputError, SkillRefusedError) as refusal:
        raise StepRefusedError(str(refusal)) from refusal
    hold = hold_condition_for(configuration.site, ecm.id, skill, inputs)
    return ActiveStep(ecm, skill, Caller(ecm.id, skill.id, inputs), run, hold)


def check_result_outputs(skill: Skill, ending: SkillRunResult) -> SkillRunResult:
    """The ending, with outputs that are what the skill declares; it may give none at all."""
    if ending.outputs is None:
        return ending
    try:
        return ending._replace(outputs=check_outputs(skill.outputs, ending.outputs))
    except InputError as fault:
        return SkillRunResult(StepStatus.RAISED, f"what it returned is not its outputs: {fault}")


def _find_skill(request: StepRequest, configuration: Configuration) -> tuple[Ecm, Skill]:
    """The module and the skill that are asked for, among the active ones."""
    if type(request.module) is not str or type(request.skill) is not str:
        raise StepRefusedError("module and skill are not both names")
    ecm = configuration.modules.get(request.module)
    if ecm is None:
        raise StepRefusedError(f"no module `{request.module}` is active")
    skill = ecm.skills.get(request.skill)
    if skill is None:
        raise StepRefusedError(f"module `{ecm.id}` has no skill `{request.skill}`")
    return ecm, skill
