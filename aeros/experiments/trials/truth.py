"""Whether invariants hold of what is true, tick by tick: by the definition of their language.

No reading is asked, no gate and no monitor, and nothing that was compiled of a rule: an action that moves is
looked at with the parameters that were decided, beside what the plant's ground truth is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final

from aeros.runtime.ports import Monitor, MotionCompletion, MotionHandle, PlannedMotion, Plant
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.model import Site

if TYPE_CHECKING:
    from aeros.sim.sensors import GroundTruth


REST_SPEED: Final = 0.01
"""Speed up to which a link rests, m/s: what is left of an arm that settles."""


class InvariantReferee:
    """Is told the truth of every tick (`physics.InvariantReferee`), and by `RefereedPlant` what moves.

    about: a state variable; rules that read it are looked at.
    broken: those that do not hold at the tick that was told last.
    """

    def __init__(self, site: Site, variable: str, on_truth: Callable[[GroundTruth], None]) -> None:
        self._terms: dict[str, dict[str, t.Term]] = {}
        for rule in site.rules:
            for kind, term in rule.terms.items():
                if variable in t.variables_of(term):
                    self._terms.setdefault(kind, {})[rule.id] = term
        self._told = on_truth
        self.moving: dict[MotionHandle, Action] = {}
        self.broken: tuple[str, ...] = ()

    def __call__(self, truth: GroundTruth) -> None:
        """Look at what is true now."""
        values = truth.values
        self.broken = tuple(
            rule
            for action in self.moving.values()
            for rule, term in self._terms.get(action.kind, {}).items()
            if not is_true(term, _read(term, {**values, **action.parameters}))
        )
        self._told(truth)


class RefereedPlant:
    """A plant whose referee hears what moves and what has ended; in all else the one that it is given.

    asked: hears of each rule that the monitor names.
    """

    def __init__(self, plant: Plant, referee: InvariantReferee, on_violation: Callable[[str], None]) -> None:
        self._plant = plant
        self._referee = referee
        self._asked = on_violation

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """See `Plant`."""
        begun = self._plant.begin(action, decided)
        if not isinstance(begun, MotionCompletion):
            self._referee.moving[begun] = action
        return begun

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """See `Plant`."""

        def watched(now: float, measured: Mapping[str, Any]) -> str | None:
            rule = monitor(now, measured)
            if rule is not None:
                self._asked(rule)
            return rule

        ended = self._plant.advance(watched, until)
        for motion in ended:
            self._referee.moving.pop(motion, None)
        return ended

    def stop(self) -> None:
        """See `Plant`."""
        self._plant.stop()
        self._referee.moving.clear()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)


def site_constant(site: Site, name: str) -> float:
    """A number of the site's; raises `MisuseError` where there is none."""
    found = site.constants.get(name)
    if not isinstance(found, t.Literal) or not isinstance(found.value, Fraction):
        raise MisuseError(f"the site `{site.id}` has no number `{name}`")
    return float(found.value)


def _read(term: t.Term, values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _exact(values[name]) for name in t.variables_of(term)}


def _exact(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_exact(part) for part in value)
    return Fraction(value) if isinstance(value, float) else value
