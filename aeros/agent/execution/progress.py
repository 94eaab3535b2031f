"""How far a plan has come: which tries of which steps were begun, and how each ended.

A place is where in the plan's graph a part is: the numbers of the parts on the way down to it, and, of what
helps between two tries, the number of the try before it.  Nothing here decides anything; the engine asks
it where to go on, and checkpoints keep it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from aeros.agent.execution.step_attempt import Attempt
from aeros.runtime.ports import Head

Place = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Begun:
    """A try whose end nobody has acknowledged.

    skill: or the capability, where the step names one.
    before: the predicates as they were measured when it began.
    head: where the audit record ended then.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any]
    before: Mapping[str, Any]
    head: Head


@dataclass
class Tried:
    """What has been tried at one place.

    tries: how many were begun.
    begun: the one under way, if there is one.
    last: how the last one ended, if it has.
    """

    tries: int = 0
    begun: Begun | None = None
    last: Attempt | None = None


@dataclass
class Progress:
    """Of one plan.

    settled: places at which nothing is left to do.
    branches: at each `if` that was decided, whether `then` is followed.
    changed: called after what a resumed agent must know of has changed.
    """

    tried: dict[Place, Tried] = field(default_factory=dict)
    settled: set[Place] = field(default_factory=set)
    branches: dict[Place, bool] = field(default_factory=dict)
    changed: Callable[[], None] = lambda: None

    def tries(self, at: Place) -> int:
        """How many tries were begun at that place."""
        return self.tried[at].tries if at in self.tried else 0

    def last(self, at: Place) -> Attempt | None:
        """How the last try ended there; None where there was none."""
        return self.tried[at].last if at in self.tried else None

    def is_done(self, at: Place) -> bool:
        """Whether nothing is left to do there."""
        last = self.last(at)
        return at in self.settled or (last is not None and not last.failed)

    def settle(self, at: Place) -> None:
        """Nothing is left to do there."""
        self.settled.add(at)

    def begin(self, at: Place, begun: Begun) -> None:
        """A try is about to begin."""
        tried = self.tried.setdefault(at, Tried())
        tried.tries, tried.begun, tried.last = tried.tries + 1, begun, None
        self.changed()

    def conclude(self, at: Place, how: Attempt) -> None:
        """It has ended; but one that was stopped from outside has only been left."""
        if not how.halted:
            self.tried[at].begun, self.tried[at].last = None, how
            self.changed()

    def withdraw(self, at: Place) -> None:
        """It was never begun."""
        tried = self.tried[at]
        tried.tries, tried.begun = tried.tries - 1, None

    def choose(self, at: Place, then: bool) -> None:
        """An `if` was decided."""
        self.branches[at] = then
        self.changed()

    def under_way(self) -> list[tuple[Place, Begun]]:
        """What was begun and not acknowledged, in the order of places."""
        return [(at, one.begun) for at, one in sorted(self.tried.items()) if one.begun is not None]
