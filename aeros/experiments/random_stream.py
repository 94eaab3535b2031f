"""What chance does to the plant of a trial, and to which other trials it would have done the same.

A plant does the same whenever the same is asked of it and chance does the same.  On the symbolic plant all
that chance does is the outcome of each run of a skill, so trials of several seeds may share what a plant did;
on physics a seed decides far more, and only trials of that seed may.
"""

from __future__ import annotations

from typing import Any, Protocol

from aeros.experiments.trial_plants import Opened
from aeros.sim.symbolic.outcomes import Drawing, Draws


class Luck(Protocol):
    """The chance of one trial.

    shared: names whose plants may be compared with its own.
    """

    @property
    def shared(self) -> str:
        """See `Luck`."""

    def seen(self, opened: Opened) -> Any:
        """What chance has done so far to a plant of its own."""

    def would_do(self, seen: Any) -> bool:
        """Whether it would have done what it was `seen` to do to a plant that may be compared."""

    def alike(self, seen: Any) -> tuple[float, float]:
        """Numbers of the condition, exclusive, with which its seed would do the same, once it has done so."""


class LuckOfASeed:
    """Where all that is known is between which numbers the same seed does the same: `Opened.chance`.

    number: the condition's: a rate, say.
    """

    def __init__(self, seed: int, number: float) -> None:
        self.shared = f"seed {seed}"
        self._number = number

    def seen(self, opened: Opened) -> tuple[float, tuple[float, float]]:
        """Its number, and those between which all would be the same; none where the plant does not say."""
        return self._number, opened.chance() if opened.chance else (self._number, self._number)

    def would_do(self, seen: tuple[float, tuple[float, float]]) -> bool:
        """See `Luck`."""
        number, (low, high) = seen
        return self._number == number or low < self._number < high

    def alike(self, seen: tuple[float, tuple[float, float]]) -> tuple[float, float]:
        """See `Luck`."""
        return seen[1]


class LuckOfDraws:
    """Where outcomes of skills are drawn and nothing else is: `Opened.chance` tells which were.

    draws: of the trial's seed, at its condition's number.
    drawing: what else would draw the same of the skill that fails.
    """

    shared = "draws"

    def __init__(self, seed: int, draws: Draws, drawing: Drawing) -> None:
        self._seed = seed
        self._draws = draws
        self._drawing = drawing

    def seen(self, opened: Opened) -> Any:
        """See `Luck`."""
        assert opened.chance is not None  # noqa: S101  a symbolic plant's
        return opened.chance()

    def would_do(self, seen: Any) -> bool:
        """See `Luck`."""
        outcome = self._draws.outcome
        return all(outcome(skill, run).id == had for skill, run, had in seen)

    def alike(self, seen: Any) -> tuple[float, float]:
        """See `Luck`."""
        name = self._drawing.skill
        return self._drawing.alike(self._seed, sum(one.skill == name for one in seen))
