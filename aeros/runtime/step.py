"""A step as the executor has it: its skill's run, what was decided of it, and what it moves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from aeros.runtime.audit import DecisionCounts
from aeros.runtime.beside import Begun
from aeros.runtime.decision import Caller
from aeros.runtime.holding import Hold
from aeros.runtime.observation import Sight
from aeros.runtime.ports import Motion, Plan, StepStatus
from aeros.runtime.skill_run import Ending, Run
from aeros.skill import Action
from aeros.spec.model import Ecm, Site, Skill


class UnderWay(NamedTuple):
    """A step's action on the plant.

    plan: what the plant said it would be, where it was asked.
    is_halting: it comes to rest before its end.
    """

    motion: Motion
    begun: Begun
    plan: Plan | None
    is_halting: bool = False


@dataclass
class Step:
    """A step that was started.

    deadline: plant seconds; runs once it has begun, which is when it holds what it needs.
    hold: what must be measured as long as it runs.
    actions: how often the skill was asked for one.
    sight: what it is told of the state, by the site that governed when it was told last.
    asked: the action that it asked for, not yet decided.
    may_pass: what it was denied last may be allowed later.
    ending: how it ends, from when that is known; what it moves may still have to come to rest.
    """

    ecm: Ecm
    skill: Skill
    caller: Caller
    run: Run
    hold: Hold | None = None
    deadline: float = 0.0
    has_begun: bool = False
    actions: int = 0
    sight: Sight | None = None
    asked: Action | None = None
    under_way: UnderWay | None = None
    may_pass: bool = False
    ending: Ending | None = None
    counts: DecisionCounts = field(default_factory=DecisionCounts)

    @property
    def name(self) -> str:
        """The skill, as `MODULE.SKILL`."""
        return f"{self.caller.module}.{self.caller.skill}"

    @property
    def is_due(self) -> bool:
        """Whether its skill is the next to do something."""
        return self.has_begun and self.under_way is None

    @property
    def finished(self) -> bool:
        """Whether the skill ran to its own end."""
        return self.ending is not None and self.ending.status is StepStatus.FINISHED

    def close(self) -> None:
        """End the skill; where its own clean-up raises, the ending says so."""
        complaint = self.run.close()
        if complaint is not None and self.ending is not None:
            reason = f"{self.ending.reason}; and its own clean-up raised {complaint}"
            self.ending = self.ending._replace(reason=reason)


def needs_of(skill: Skill) -> frozenset[str]:
    """What a step of the skill holds: its resources and its actuators."""
    return skill.resources | {_actuator(name) for name in skill.actuators}


def capacities_of(site: Site) -> dict[str, int]:
    """How many steps may hold each resource at one time, and each actuator: one."""
    moved = {name for kind in site.kinds.values() for name in kind.actuators}
    return {**site.resources, **{_actuator(name): 1 for name in moved}}


def _actuator(name: str) -> str:
    """Named apart: a site may have a resource of the same name, and count it otherwise."""
    return f"actuator {name}"
