"""Referee of invariants on the true state, tick by tick, by the definition of their language.

It uses no reading, no gate, no monitor, and nothing that was compiled from a rule: it evaluates rules on an
action that moves, with the parameters that were decided, and on the plant's ground truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final

from aeros.runtime.ports import Monitor, MotionCompletion, MotionHandle, ObservedMonitor, PlannedMotion, Plant
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.sensors import GroundTruth


REST_SPEED: Final = 0.01
"""Speed up to which a link counts as at rest, m/s: that of an arm that settles."""


class InvariantReferee:
    """Referee of invariants, called with the true state of every tick; `RefereedPlant` reports what moves.

    Args:
        site: its rules are judged.
        variable: a state variable; only rules that read it are judged.
        on_truth: called with the true state after each judgement.

    Attributes:
        moving: actions under way.
        broken: rules that do not hold at the last tick.
    """

    def __init__(self, site: Site, variable: str, on_truth: Callable[[GroundTruth], None]) -> None:
        self._terms: dict[str, dict[str, t.Term]] = {}
        for rule in site.rules:
            for kind, term in rule.terms.items():
                if variable in t.variables_of(term):
                    self._terms.setdefault(kind, {})[rule.id] = term
        self._on_truth = on_truth
        self.moving: dict[MotionHandle, Action] = {}
        self.broken: tuple[str, ...] = ()

    def __call__(self, truth: GroundTruth) -> None:
        """Judge the true state after a tick."""
        values = truth.values
        self.broken = tuple(
            rule
            for action in self.moving.values()
            for rule, term in self._terms.get(action.kind, {}).items()
            if not is_true(term, _read(term, {**values, **action.parameters}))
        )
        self._on_truth(truth)


class RefereedPlant:
    """Plant that reports to a referee what moves and what has ended, and passes all else on.

    Args:
        plant: the plant that does the work.
        referee: of the same trial.
        on_violation: called with each rule that the monitor names.
    """

    def __init__(self, plant: Plant, referee: InvariantReferee, on_violation: Callable[[str], None]) -> None:
        self._plant = plant
        self._referee = referee
        self._on_violation = on_violation

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`."""
        started = self._plant.begin(action, decided)
        if not isinstance(started, MotionCompletion):
            self._referee.moving[started] = action
        return started

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`."""
        is_stopping = False

        def note(now: float, measured: Mapping[str, Any], rule: str | None) -> None:
            nonlocal is_stopping
            if rule is not None and not is_stopping:
                is_stopping = True
                self._on_violation(rule)

        ended = self._plant.advance(ObservedMonitor(monitor, note), until)
        for motion in ended:
            self._referee.moving.pop(motion, None)
        return ended

    def stop(self) -> None:
        """Implement `Plant.stop`."""
        self._plant.stop()
        self._referee.moving.clear()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)


def site_constant(site: Site, name: str) -> float:
    """Read a number of a site.

    Args:
        site: the site.
        name: of the constant.

    Returns:
        Its value, in SI units.

    Raises:
        MisuseError: the site has no such number.
    """
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
