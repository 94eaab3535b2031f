"""Run of a skill's generator in this process: whatever the code does becomes an action or an ending.

For modules that the site trusts. Code that loops without yielding cannot be interrupted in this process;
`isolation` runs a skill in a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from aeros.descriptions import describe_exception
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import (
    NoActionError,
    SkillFunction,
    check_outputs,
    continue_skill,
    copy_action,
    start_skill,
)
from aeros.runtime.skills.load import CertifiedCode, certified_code, execute_code, load_certified_models
from aeros.runtime.skills.raised import describe_raised
from aeros.skill import Action, ActionDenied, Models, Observation, SkillBody
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site


class SkillRunResult(NamedTuple):
    """Ending of a skill's run.

    Attributes:
        status: kind of its end.
        reason: text of the reason; empty if it finished.
        outputs: values that it returned, if it finished and returned any.
        causes: the reason as data, if there is more to it than words.
        lost_hold: position in `StepRequest.held` of the condition that was lost; None if none was.
        denials: of a denied skill, number of denials that no other way made up for.
    """

    status: StepStatus
    reason: str
    outputs: Mapping[str, Any] | None = None
    causes: tuple[Cause, ...] = ()
    lost_hold: int | None = None
    denials: int = 0


class SkillRunProtocol(Protocol):
    """One run of a skill, loaded and not yet started."""

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        """Run the skill up to its next action or its end.

        Args:
            observation: values that the skill senses now, SI, by name.
            seconds: remaining time until its timeout, plant seconds.
            denial: why its last action was denied for good; empty if it was not.

        Returns:
            A copy of the requested action, or the ending: with status DENIED if it caught no denial.
        """

    def close(self) -> str | None:
        """End the skill; safe to call twice.

        Returns:
            Description of what the skill's own clean-up raised; None if nothing.
        """


OpenRun = Callable[[Site, Ecm, Skill, Mapping[str, Any]], SkillRunProtocol]
"""Opens a run of a skill with checked inputs under the site in force; raises `SkillRefusedError`."""


def run_in_process(_: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
    """Open a run in this process; trusts the code with everything this process can reach.

    Args:
        ecm: the module.
        skill: the skill of it to run.
        inputs: checked inputs, SI, by name.

    Returns:
        The run, not yet started.

    Raises:
        SkillRefusedError: the code is not the certified code, or is not a skill.
    """
    code = certified_code(ecm, skill)
    return InProcessRun(execute_code(code), inputs, load_certified_models(code))


class CachedRunFactory:
    """Opens runs as `run_in_process` does, reading the code once: for many trials in one process.

    The cached bytes have the certified digest. A file that changes meanwhile is neither executed nor noticed.
    """

    def __init__(self) -> None:
        self._code: dict[tuple[str, str, str], CertifiedCode] = {}

    def __call__(self, _: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        """Implement `OpenRun`."""
        key = ecm.id, ecm.code_digest, skill.id
        if key not in self._code:
            self._code[key] = certified_code(ecm, skill)
        code = self._code[key]
        return InProcessRun(execute_code(code), inputs, load_certified_models(code))


def finished_result(value: object) -> SkillRunResult:
    """Return the ending of a skill that ran to its end.

    Args:
        value: whatever the skill returned.

    Returns:
        Status FINISHED with the outputs; status RAISED if `value` is not a set of outputs.
    """
    try:
        return SkillRunResult(StepStatus.FINISHED, "", check_outputs(value))
    except NoActionError as failure:
        return SkillRunResult(StepStatus.RAISED, str(failure))


class InProcessRun:
    """Run of a generator in this process, not yet started.

    Args:
        function: the generator function.
        inputs: checked inputs, SI, by name.
        models: the models that the skill declares, by name.
    """

    def __init__(
        self, function: SkillFunction, inputs: Mapping[str, Any], models: Models = MappingProxyType({})
    ) -> None:
        self._function = function
        self._models = models
        # A copy, so that the skill cannot change the inputs that the gate sees.
        self._inputs = dict(inputs)
        self._body: SkillBody | None = None

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        """Implement `SkillRunProtocol.resume`; takes as long as the code does.

        Raises:
            KeyboardInterrupt: the user interrupted the code.
        """
        del seconds  # cannot be enforced in this process
        try:
            if self._body is None:
                self._body = start_skill(self._function, observation, self._inputs, self._models)
                yielded = next(self._body)
            else:
                yielded = continue_skill(self._body, observation, denial)
            return copy_action(yielded)
        except StopIteration as end:
            return finished_result(end.value)
        except ActionDenied as uncaught:
            reason = describe_exception(uncaught)
            return SkillRunResult(StepStatus.DENIED, reason, denials=uncaught.denials)
        except KeyboardInterrupt:
            raise
        except NoActionError as failure:
            return SkillRunResult(StepStatus.RAISED, str(failure))
        except BaseException as failure:
            known = (*observation, *self._inputs)
            return SkillRunResult(StepStatus.RAISED, describe_raised(failure, self._function, known))

    def close(self) -> str | None:
        """Implement `SkillRunProtocol.close`.

        Raises:
            KeyboardInterrupt: the user interrupted the clean-up.
        """
        if self._body is None:
            return None
        try:
            self._body.close()
        except KeyboardInterrupt:
            raise
        except BaseException as failure:
            return describe_exception(failure)
        return None
