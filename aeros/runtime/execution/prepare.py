"""Preparation of a step: checks of its request against the active modules, and of its outputs."""

from __future__ import annotations

from aeros.runtime.execution.hold_condition import hold_conditions_for
from aeros.runtime.execution.inputs import InputError, check_inputs, check_outputs
from aeros.runtime.execution.resources import ResourceQueue
from aeros.runtime.execution.step import ActiveStep, required_resources
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller
from aeros.runtime.ports import StepRequest, StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import OpenRun, SkillRunResult
from aeros.spec.model.ecm import Ecm, Skill


class StepRefusedError(Exception):
    """The step is refused before it starts; the message says why."""


def prepare_step(
    request: StepRequest, configuration: Configuration, resources: ResourceQueue, open_run: OpenRun
) -> ActiveStep:
    """Check a request and open the run of its skill.

    Args:
        request: module, skill and inputs.
        configuration: configuration in force.
        resources: resources of the site, with their capacities.
        open_run: opens the run of the skill.

    Returns:
        The step, ready to start.

    Raises:
        StepRefusedError: the module or skill is not active, a resource does not exist, an input is wrong, or
            the code is not the certified code.
    """
    ecm, skill = _find_skill(request, configuration)
    lacking = resources.never_available(required_resources(skill))
    if lacking is not None:
        raise StepRefusedError(f"this site has no `{lacking}`")
    try:
        inputs = check_inputs(skill.inputs, request.inputs)
        run = open_run(configuration.site, ecm, skill, inputs)
    except (InputError, SkillRefusedError) as refusal:
        raise StepRefusedError(str(refusal)) from refusal
    holds = hold_conditions_for(configuration.site, ecm.id, skill, inputs, request.held)
    return ActiveStep(ecm, skill, Caller(ecm.id, skill.id, inputs), run, holds)


def check_result_outputs(skill: Skill, ending: SkillRunResult) -> SkillRunResult:
    """Check the outputs that a skill returned.

    Args:
        skill: declares the outputs.
        ending: end of the run, with or without outputs.

    Returns:
        `ending` with converted outputs, or unchanged if the skill returned None; an ending with status RAISED
        if the outputs differ from the declaration.
    """
    if ending.outputs is None:
        return ending
    try:
        return ending._replace(outputs=check_outputs(skill.outputs, ending.outputs))
    except InputError as fault:
        return SkillRunResult(StepStatus.RAISED, f"the returned outputs differ from its declaration: {fault}")


def _find_skill(request: StepRequest, configuration: Configuration) -> tuple[Ecm, Skill]:
    """Find the requested module and skill among the active ones.

    Raises:
        StepRefusedError: there is no such module or skill.
    """
    if type(request.module) is not str or type(request.skill) is not str:
        raise StepRefusedError("module and skill are not both names")
    ecm = configuration.modules.get(request.module)
    if ecm is None:
        raise StepRefusedError(f"no module `{request.module}` is active")
    skill = ecm.skills.get(request.skill)
    if skill is None:
        raise StepRefusedError(f"module `{ecm.id}` has no skill `{request.skill}`")
    return ecm, skill
