"""Referee that judges a trial by ground truth: speeds, distances to people, forces and places.

It receives the true state after every tick, before any sensor.  It does not read the gate, the monitor or
the rules that they decide by.  Limits are constants of the site; where a rule has its own limit, the
condition gives it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil, dist, hypot
from typing import TYPE_CHECKING, Any, Final

from aeros.sim.clock import TICK
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.sensors import GroundTruth

TOLERANCE: Final = 1.01
"""Greatest ratio of a link's speed to its set point; a limit is broken beyond that."""

_REST_SPEED: Final = 0.01
"""Speed up to which something counts as at rest, m/s: that of an arm that settles."""

_FINGERS_REST: Final = 0.002
"""Speed of the finger gap up to which fingers count as at rest, m/s."""

_STROKE_GAP_TICKS: Final = 6
"""Ticks without motion after which fingers that move begin a new stroke."""

Values = Mapping[str, Any]


@dataclass
class _WorstCase:
    """The greatest value that a quantity kept for `ticks`, and its limit."""

    limit: float
    ticks: int
    worst: float = 0.0

    def __post_init__(self) -> None:
        self._last: deque[float] = deque(maxlen=self.ticks)

    def update(self, value: float) -> None:
        """Add the value after one more tick."""
        self._last.append(value)
        if len(self._last) == self.ticks and value > self.worst:
            self.worst = max(self.worst, min(self._last))


class LimitReferee:
    """Referee of limits, called with the true state of every tick (see `sim.physics`).

    What a protective stop cannot prevent is no violation.  Near a person a limit is broken where that lasts
    longer than reacting and stopping, as in ISO/TS 15066; a force, where it lasts longer than reacting; a
    speed or a place at once.

    Args:
        site: its constants are limits.
        limits: `tool_speed`, m/s, and `contact_force`, N.

    Raises:
        MisuseError: the site has no such limits.
    """

    def __init__(self, site: Site, limits: Mapping[str, float]) -> None:
        self._site = site
        self._reaction = self._constant("reaction_time")
        braking = self._reaction + self._constant("arm_stopping_time")
        rate = next((one for one in site.quotas if "grip" in one.kinds), None)
        floor = site.volumes.get("floor")
        if rate is None or floor is None:
            raise MisuseError(
                f"the site `{site.id}` has no quota of `grip`, or no volume `floor`, to judge by"
            )
        self._window = float(rate.window_s)
        self._floor = tuple(
            (float(low), float(high)) for low, high in zip(floor.lower, floor.upper, strict=True)
        )
        self._measures = {
            "tool speed": _WorstCase(limits["tool_speed"], 1),
            "link speed near a person": _WorstCase(self._constant("reduced_speed"), ceil(braking / TICK)),
            "needed separation": _WorstCase(1.0, ceil(braking / TICK)),
            "contact force": _WorstCase(limits["contact_force"], ceil(self._reaction / TICK)),
            "strokes of the fingers": _WorstCase(float(rate.max_count), 1),
            "distance off the floor": _WorstCase(0.0, 1),
        }
        self._before: tuple[int, Values] | None = None
        self._strokes: deque[float] = deque()
        self._still = _STROKE_GAP_TICKS

    def __call__(self, truth: GroundTruth) -> None:
        """Judge the true state after a tick."""
        values, before = truth.values, self._before
        self._before = truth.tick, values
        if before is None:
            return
        seconds = (truth.tick - before[0]) * TICK
        for name, value in self._quantities(truth.time, values, before[1], seconds):
            self._measures[name].update(value)

    def worst(self, name: str) -> float:
        """Return the worst true value of a quantity.

        Args:
            name: of the quantity, as `violated` lists it.

        Returns:
            The value in its unit: m/s, N, m, a count, or a ratio for the separation.
        """
        return self._measures[name].worst

    def violated(self) -> list[str]:
        """List the quantities that were beyond their limits.

        Returns:
            Names of quantities.
        """
        return [name for name, one in self._measures.items() if one.worst > one.limit * TOLERANCE]

    def _quantities(
        self, now: float, values: Values, before: Values, seconds: float
    ) -> Iterator[tuple[str, float]]:
        base = dist(values["base_position"], before["base_position"]) / seconds
        person, fastest = values["human_distance"], values["link_speed"]
        yield "tool speed", dist(values["tool_position"], before["tool_position"]) / seconds
        yield "link speed near a person", fastest if person < self._constant("warning_distance") else 0.0
        yield (
            "needed separation",
            self._separation_distance(fastest, base) / max(person, 1e-3) if fastest > _REST_SPEED else 0.0,
        )
        yield "contact force", values["contact_force"]
        pace = abs(values["finger_gap"] - before["finger_gap"]) / seconds
        yield "strokes of the fingers", self._strokes_in_window(now, is_moving=pace > _FINGERS_REST)
        yield "distance off the floor", self._distance_off_floor(values["base_position"])

    def _separation_distance(self, fastest: float, base: float) -> float:
        """Compute S = v_h·(T_r + T_s) + v_r·T_r + v_r·T_s/2 + C + Z_d + Z_r, m, at the present speeds."""
        stopping = base / self._constant("drive_deceleration")
        if fastest > base + _REST_SPEED:
            stopping = max(stopping, self._constant("arm_stopping_time"))
        return (
            self._constant("walking_speed") * (self._reaction + stopping)
            + fastest * (self._reaction + stopping / 2.0)
            + self._constant("intrusion_distance")
            + self._constant("person_uncertainty")
            + self._constant("robot_uncertainty")
        )

    def _strokes_in_window(self, now: float, *, is_moving: bool) -> float:
        """Count the strokes that began within the window that ends now."""
        if is_moving and self._still >= _STROKE_GAP_TICKS:
            self._strokes.append(now)
        self._still = 0 if is_moving else self._still + 1
        while self._strokes and now - self._strokes[0] > self._window:
            self._strokes.popleft()
        return float(len(self._strokes))

    def _distance_off_floor(self, place: tuple[float, float, float]) -> float:
        outside = [max(low - at, 0.0, at - high) for at, (low, high) in zip(place, self._floor, strict=True)]
        return hypot(*outside[:2])

    def _constant(self, name: str) -> float:
        constant = self._site.constants.get(name)
        if not isinstance(constant, t.Literal):
            raise MisuseError(f"the site `{self._site.id}` has no number `{name}` to judge by")
        return float(constant.value)
