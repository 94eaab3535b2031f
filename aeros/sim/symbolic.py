"""The symbolic plant: declared outcomes with declared probabilities, in microseconds.

The lowest rung of the fidelity ladder.  Motions take effect at once and cost time on the plant's
clock; predicates change only when a skill ends, by one of the outcomes its manifest declares.  It is
what the closed-loop analysis assumes of the world, made to run.
Not modelled: anything a manifest does not declare; where an interrupted motion stops.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from aeros.runtime.ports import Completion, Monitor, Motionless, Plan, Reading, Readings
from aeros.sim.outcomes import draw_outcome
from aeros.sim.symbolic_motions import Motion, UnableError, motion_of
from aeros.sim.symbolic_state import initial_values, measured
from aeros.skill import Action
from aeros.spec.closed_loop.chances import shares_of
from aeros.spec.errors import MisuseError
from aeros.spec.model import Ecm, Outcome, Site


class SymbolicPlant:
    """Implements `aeros.runtime.ports.Plant` from declarations alone; readings are always fresh.

    modules: whose skills may run, by name.
    seed: the same seed and the same steps give the same run.
    initial: values that differ from the harmless default, by vocabulary name, SI.
    """

    def __init__(
        self, site: Site, modules: Mapping[str, Ecm], seed: int, initial: Mapping[str, Any] | None = None
    ) -> None:
        self._site = site
        self._seed = seed
        self._time = 0.0
        self._values = initial_values(site, initial or {})
        self._shares = {
            f"{ecm.id}.{skill.id}": shares_of(skill.outcomes.values())
            for ecm in modules.values()
            for skill in ecm.skills.values()
        }
        self._effects = {
            (name, outcome.id): self._settled(name, outcome)
            for name, shares in self._shares.items()
            for outcome, _ in shares
        }
        self._runs: Counter[str] = Counter()
        self._began = 0.0

    def now(self) -> float:
        """Seconds that motions, waits and declared durations have cost so far."""
        return self._time

    def observe(self) -> Readings:
        """Every state variable of the vocabulary, measured now."""
        return {name: Reading(value, self._time) for name, value in self._values.items()}

    def plan(self, action: Action) -> Plan:
        """Nothing: there is no body that could move through anything."""
        return Motionless("this plant has no body")

    def execute(
        self, action: Action, monitor: Monitor, deadline: float, decided: Plan | None = None
    ) -> Completion:
        """Do `action` at once; `monitor` sees it under way and at its end, before time passes."""
        if action.kind not in self._site.kinds:
            return Completion(False, f"unknown kind: `{action.kind}`")
        try:
            motion = motion_of(action, self._values)
        except UnableError as reason:
            return Completion(False, str(reason))
        after = {**self._values, **self._known(motion.after)}
        for seen in ({**self._values, **self._known(motion.under_way)}, after):
            rule = monitor(self.now(), seen)
            if rule is not None:
                return Completion(False, f"monitor:{rule}")
        return self._elapse(motion, after, deadline)

    def stop(self) -> None:
        """Nothing moves between actions, so there is nothing to bring to rest."""

    def skill_began(self, skill: str) -> None:
        """Remember when; raises MisuseError for a skill of no module."""
        if skill not in self._shares:
            raise MisuseError(f"no module has the skill `{skill}`")
        self._began = self._time

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """If it ran to its own end, draw one of its outcomes and let its effects be measured.

        A skill that was halted has none of its declared outcomes: nothing changes.
        """
        if not finished:
            return
        run = self._runs[skill]
        self._runs[skill] += 1
        outcome = draw_outcome(self._shares[skill], self._seed, skill, run)
        if outcome.duration is not None:
            self._time = max(self._time, self._began + float(outcome.duration))
        self._values.update(self._effects[skill, outcome.id])

    def close(self) -> None:
        """Nothing is held."""

    # Inside.

    def _elapse(self, motion: Motion, after: dict[str, Any], deadline: float) -> Completion:
        if self._time + motion.duration > deadline:
            self._time = max(self._time, deadline)
            return Completion(False, "deadline")
        self._time += motion.duration
        self._values = after
        return Completion(True)

    def _known(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Those that the site's vocabulary has."""
        return {name: value for name, value in values.items() if name in self._values}

    def _settled(self, skill: str, outcome: Outcome) -> dict[str, Any]:
        unknown = outcome.effects.keys() - self._site.state.keys()
        if unknown:
            raise MisuseError(f"an effect of `{skill}` is on `{min(unknown)}`, which is no state variable")
        return {name: measured(value, self._site.state[name]) for name, value in outcome.effects.items()}
