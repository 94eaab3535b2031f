"""One run of a skill's generator: whatever the code does comes back as an action or as an ending.

The one thing that does not come back is code that spins without yielding: in this process nothing
can interrupt it.  A time-out needs the skill in a process of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from aeros.runtime.canonical import type_name
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills import SkillFunction, told
from aeros.skill import Action, Observation, SkillBody

MOST_PARAMETERS: Final = 64
"""Parameters of one action at most; no kind has nearly as many, and every one is recorded."""


class Ending(NamedTuple):
    """How a skill's run ended, and why in words; no words when it finished."""

    status: StepStatus
    reason: str


class SkillRun:
    """A generator, not yet started."""

    def __init__(self, function: SkillFunction, inputs: Mapping[str, Any]) -> None:
        self._function = function
        # A copy of its own: what the gate judges by must not be in the skill's hands.
        self._inputs = dict(inputs)
        self._body: SkillBody | None = None

    def resume(self, observed: Observation) -> Action | Ending:
        """Run the skill up to its next action, a snapshot of which is returned, or to its end."""
        try:
            if self._body is None:
                self._body = self._function(observed, self._inputs)
                yielded = next(self._body)
            else:
                yielded = self._body.send(observed)
        except StopIteration:
            return Ending(StepStatus.FINISHED, "")
        except KeyboardInterrupt:
            raise
        except BaseException as failure:
            return Ending(StepStatus.RAISED, told(failure))
        return _snapshot(yielded)

    def close(self) -> str | None:
        """End the generator; what its own clean-up raised, if anything."""
        if self._body is None:
            return None
        try:
            self._body.close()
        except KeyboardInterrupt:
            raise
        except BaseException as failure:
            return told(failure)
        return None


def _snapshot(yielded: object) -> Action | Ending:
    """The action as it is now: later changes to its parameters change nothing that was decided."""
    if type(yielded) is not Action:
        return Ending(StepStatus.RAISED, f"the skill yielded a `{type_name(yielded)}`, not an action")
    if type(yielded.parameters) is not dict or len(yielded.parameters) > MOST_PARAMETERS:
        reason = f"the skill yielded parameters that are no dict of at most {MOST_PARAMETERS}"
        return Ending(StepStatus.RAISED, reason)
    try:
        # Lists too are copied, to tuples; what is nested deeper no action kind has, so the gate denies it.
        parameters = {
            name: tuple(value) if type(value) is list else value
            for name, value in dict(yielded.parameters).items()
        }
    except Exception as failure:
        return Ending(StepStatus.RAISED, f"the skill yielded parameters that are no mapping: {told(failure)}")
    if type(yielded.kind) is not str or not all(type(name) is str for name in parameters):
        return Ending(StepStatus.RAISED, "the skill yielded a kind or a parameter name that is no text")
    return Action(yielded.kind, parameters)
