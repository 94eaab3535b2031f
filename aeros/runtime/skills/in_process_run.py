"""One run of a skill's generator in this process: what the code does comes back as an action or an ending.

For modules that the site trusts.  The one thing that does not come back is code that spins without
yielding: in this process nothing can interrupt it.  `isolation` runs a skill in a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

from aeros.descriptions import describe_exception
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import NoActionError, SkillFunction, check_outputs, copy_action
from aeros.runtime.skills.load import CertifiedCode, certified_code, execute_code, load_skill
from aeros.skill import Action, Observation, SkillBody
from aeros.spec.model.cause import Cause
from aeros.spec.model.model import Ecm, Site, Skill


class SkillRunResult(NamedTuple):
    """How a skill's run ended, and why in words; no words when it finished.

    outputs: what it returned, if it finished and returned something.
    causes: the reason as data, where there is more to it than words.
    """

    status: StepStatus
    reason: str
    outputs: Mapping[str, Any] | None = None
    causes: tuple[Cause, ...] = ()


class SkillRunProtocol(Protocol):
    """One run of a skill, loaded and not yet started."""

    def resume(self, observation: Observation, seconds: float) -> Action | SkillRunResult:
        """The skill's next action, a snapshot of it, or its end.

        seconds: what is left of its time-out, on the plant's clock.
        """

    def close(self) -> str | None:
        """End the skill; what its own clean-up raised, if anything.  Safe to call twice."""


OpenRun = Callable[[Site, Ecm, Skill, Mapping[str, Any]], SkillRunProtocol]
"""Opens a run of a skill with these inputs under the site that governs; raises `SkillRefusedError`."""


def run_in_process(_: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
    """A run in this process.  Trusts the code with everything this process can reach."""
    return InProcessRun(load_skill(ecm, skill), inputs)


class CachedRunFactory:
    """Opens runs as `run_in_process` does, of code that is read once: for many trials in one process.

    What is kept is bytes, by the digest that they were certified with.  A file that is changed meanwhile is
    neither executed nor noticed.
    """

    def __init__(self) -> None:
        self._kept: dict[tuple[str, str, str], CertifiedCode] = {}

    def __call__(self, _: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        """See `OpenRun`."""
        which = ecm.id, ecm.code_digest, skill.id
        if which not in self._kept:
            self._kept[which] = certified_code(ecm, skill)
        return InProcessRun(execute_code(self._kept[which]), inputs)


def finished_result(value: object) -> SkillRunResult:
    """How a skill ended that returned `value`."""
    try:
        return SkillRunResult(StepStatus.FINISHED, "", check_outputs(value))
    except NoActionError as failure:
        return SkillRunResult(StepStatus.RAISED, str(failure))


class InProcessRun:
    """A generator, not yet started."""

    def __init__(self, function: SkillFunction, inputs: Mapping[str, Any]) -> None:
        self._function = function
        # A copy of its own: what the gate judges by must not be in the skill's hands.
        self._inputs = dict(inputs)
        self._body: SkillBody | None = None

    def resume(self, observation: Observation, seconds: float) -> Action | SkillRunResult:
        """Run the skill up to its next action or its end, however long it takes."""
        del seconds  # nothing here could hold it to them
        try:
            if self._body is None:
                self._body = self._function(observation, self._inputs)
                yielded = next(self._body)
            else:
                yielded = self._body.send(observation)
            return copy_action(yielded)
        except StopIteration as end:
            return finished_result(end.value)
        except KeyboardInterrupt:
            raise
        except NoActionError as failure:
            return SkillRunResult(StepStatus.RAISED, str(failure))
        except BaseException as failure:
            return SkillRunResult(StepStatus.RAISED, describe_exception(failure))

    def close(self) -> str | None:
        """End the generator; what its own clean-up raised, if anything."""
        if self._body is None:
            return None
        try:
            self._body.close()
        except KeyboardInterrupt:
            raise
        except BaseException as failure:
            return describe_exception(failure)
        return None
