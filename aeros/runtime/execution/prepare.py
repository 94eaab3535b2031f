"""What is asked of a skill, and what it gives at its end, against what is active and what it declares."""

from __future__ import annotations

from aeros.runtime.execution.hold_condition import hold_of
from aeros.runtime.execution.inputs import InputError, settle_inputs, settle_outputs
from aeros.runtime.execution.resources import Resources
from aeros.runtime.execution.step import Step, needs_of
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller
from aeros.runtime.ports import StepRequest, StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import Ending, OpenRun
from aeros.spec.model.model import Ecm, Skill


class RefusedError(Exception):
    """The step never starts; the message says why."""


def prepared(
    request: StepRequest, configuration: Configuration, resources: Resources, open_run: OpenRun
) -> Step:
    """The step that is asked for, ready to start; raises `RefusedError`."""
    ecm, skill = _found(request, configuration)
    lacking = resources.lacking(needs_of(skill))
    if lacking is not None:
        raise RefusedError(f"this site has no `{lacking}`")
    try:
        inputs = settle_inputs(skill.inputs, request.inputs)
        run = open_run(configuration.site, ecm, skill, inputs)
    except (InputError, SkillRefusedError) as refusal:
        raise RefusedError(str(refusal)) from refusal
    hold = hold_of(configuration.site, ecm.id, skill, inputs)
    return Step(ecm, skill, Caller(ecm.id, skill.id, inputs), run, hold)


def with_outputs(skill: Skill, ending: Ending) -> Ending:
    """The ending, with outputs that are what the skill declares; it may give none at all."""
    if ending.outputs is None:
        return ending
    try:
        return ending._replace(outputs=settle_outputs(skill.outputs, ending.outputs))
    except InputError as fault:
        return Ending(StepStatus.RAISED, f"what it returned is not its outputs: {fault}")


def _found(request: StepRequest, configuration: Configuration) -> tuple[Ecm, Skill]:
    """The module and the skill that are asked for, among the active ones."""
    if type(request.module) is not str or type(request.skill) is not str:
        raise RefusedError("module and skill are not both names")
    ecm = configuration.modules.get(request.module)
    if ecm is None:
        raise RefusedError(f"no module `{request.module}` is active")
    skill = ecm.skills.get(request.skill)
    if skill is None:
        raise RefusedError(f"module `{ecm.id}` has no skill `{request.skill}`")
    return ecm, skill
