"""Primitives of IS-Bench as skills of AEROS: needs and effects on the variables of a vocabulary.

Their meaning is that of the benchmark's executor, `og_ego_prim/primitives/ego_primitives.py`. An outcome of a
skill has constant effects. So a primitive whose effect depends on the state becomes several skills that
exclude each other, one for each combination of what it changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

from benchmarks.external.is_bench.conversion.formulas import FALSE, TRUE, conjunction, disjunction, negation
from benchmarks.external.is_bench.conversion.task import Action, category
from benchmarks.external.is_bench.conversion.vocabulary import (
    UnsupportedError,
    Vocabulary,
    cooked_form,
    soaked_up,
    sources,
)

MAX_CONDITIONAL_EFFECTS: Final = 6
"""Greatest number of effects of one action that depend on the state; each doubles its skills."""

_NEED_AN_EFFECT: Final = {"wipe", "soak_inside", "pour_into", "spread", "wait_for_washed"}
"""Primitives that the executor refuses where they would change nothing."""

Effects = Mapping[str, str]


@dataclass(frozen=True)
class Variant:
    """One skill of an action.

    Attributes:
        condition: what makes the action have these effects.
        effects: values of variables afterwards, as text.
    """

    condition: str
    effects: Effects


@dataclass(frozen=True)
class GroundSkill:
    """An action as skills.

    Attributes:
        action: the action.
        needs: what the benchmark's executor needs; otherwise it refuses the action.
        variants: its skills.
    """

    action: Action
    needs: str
    variants: tuple[Variant, ...]


class Primitives:
    """Maker of the skills of actions over one vocabulary."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        self._words = vocabulary
        self._task = vocabulary.task
        self._makers: Mapping[str, tuple[int, Callable[..., tuple[list[str], list[Variant]]]]] = {
            "open": (1, self._open),
            "close": (1, self._close),
            "toggle_on": (1, self._toggle_on),
            "toggle_off": (1, self._toggle_off),
            "place_on_top": (2, self._place_on_top),
            "place_inside": (2, self._place_inside),
            "wipe": (2, self._wipe),
            "soak_inside": (2, self._soak_inside),
            "soak_under": (2, self._soak_under),
            "fill_with": (2, self._fill_with),
            "pour_into": (2, self._pour_into),
            "spread": (2, self._spread),
            "wait": (1, self._wait),
            "wait_for_cooked": (1, self._wait_for_cooked),
            "wait_for_washed": (1, self._wait_for_washed),
            "wait_for_frozen": (2, self._wait_for_frozen),
        }

    def skill(self, action: Action) -> GroundSkill:
        """Make the skills of an action.

        Args:
            action: the action.

        Returns:
            The skills; their condition is `false` where the executor always refuses the action.

        Raises:
            UnsupportedError: the primitive is unknown, a thing of it is not in the task, or its effects
                depend on too many facts.
        """
        name, *things = action
        number, make = self._makers.get(name, (-1, None))
        if make is None or number != len(things):
            raise UnsupportedError(f"no primitive `{name}` of {len(things)} things")
        stranger = next((thing for thing in things if thing not in self._task.kinds), None)
        if stranger is not None:
            raise UnsupportedError(f"`{stranger}` is no thing of the task")
        needs, changes = make(*things)
        variants = _variants(changes, has_effect=name in _NEED_AN_EFFECT)
        return GroundSkill(action, conjunction(needs), tuple(variants))

    # Needs

    def _able(self, thing: str, ability: str) -> str:
        return TRUE if self._task.is_able(thing, ability) else FALSE

    def _reachable(self, thing: str) -> str:
        """Nothing that is closed has the thing in it."""
        return conjunction(
            disjunction((negation(self._words.is_inside(thing, place)), self._words.fact("open", place)))
            for place in self._task.kinds
            if self._task.is_able(place, "openable")
        )

    def _is_running(self, thing: str) -> str:
        return self._words.fact("toggled_on", thing) if self._task.is_able(thing, "toggleable") else TRUE

    def _is_heated(self, thing: str) -> str:
        """Some heat source heats the thing, and each that would is on."""
        at = {
            source: self._words.is_inside(thing, source)
            if kind in self._task.knowledge.heat_inside
            else self._words.is_carried(thing, source)
            for source, kind in self._task.kinds.items()
            if self._task.has(source, "heatSource")
        }
        running = (disjunction((negation(near), self._is_running(source))) for source, near in at.items())
        return conjunction((disjunction(at.values()), *running))

    # Primitives: what each needs, and what it changes under which condition

    def _set(self, value: str, *fact: str) -> list[Variant]:
        return [Variant(TRUE, self._words.fact_effect(value, *fact))]

    def _open(self, thing: str) -> tuple[list[str], list[Variant]]:
        is_off = negation(self._words.fact("toggled_on", thing))
        can_start = disjunction((self._words.fact("open", thing), is_off))
        return [self._able(thing, "openable"), can_start], self._set(TRUE, "open", thing)

    def _close(self, thing: str) -> tuple[list[str], list[Variant]]:
        return [self._able(thing, "openable")], self._set(FALSE, "open", thing)

    def _toggle_on(self, thing: str) -> tuple[list[str], list[Variant]]:
        is_closed = negation(self._words.fact("open", thing))
        can_start = disjunction((self._words.fact("toggled_on", thing), is_closed))
        return [self._able(thing, "toggleable"), can_start], self._set(TRUE, "toggled_on", thing)

    def _toggle_off(self, thing: str) -> tuple[list[str], list[Variant]]:
        return [self._able(thing, "toggleable")], self._set(FALSE, "toggled_on", thing)

    def _place(self, thing: str, relation: str, place: str) -> tuple[list[str], list[Variant]]:
        needs = [
            FALSE if self._task.is_substance(thing) or thing == place else TRUE,
            negation(self._words.is_carried(place, thing)),
            self._reachable(thing),
        ]
        if relation == "in" and self._task.is_able(place, "openable"):
            needs.append(self._words.fact("open", place))
        return needs, [Variant(TRUE, self._words.place_effect(thing, (relation, place)))]

    def _place_on_top(self, thing: str, place: str) -> tuple[list[str], list[Variant]]:
        return self._place(thing, "on", place)

    def _place_inside(self, thing: str, place: str) -> tuple[list[str], list[Variant]]:
        return self._place(thing, "in", place)

    def _wipe(self, thing: str, tool: str) -> tuple[list[str], list[Variant]]:
        removed: dict[str, str] = {}
        for covering in self._words.coverings(thing):
            for rule in self._task.wash_rules:
                if rule.tool == category(tool) and rule.system == category(covering):
                    one = (
                        disjunction(self._is_met(tool, *need) for need in rule.needs) if rule.needs else TRUE
                    )
                    removed[covering] = disjunction((removed.get(covering, FALSE), one))
        works = disjunction(
            conjunction((self._words.fact("covered", thing, covering), condition))
            for covering, condition in removed.items()
        )
        changes = [
            Variant(condition, self._words.fact_effect(FALSE, "covered", thing, covering))
            for covering, condition in removed.items()
        ]
        return [self._reachable(thing), self._reachable(tool), works], changes

    def _is_met(self, tool: str, what: str, substance: str) -> str:
        if what == "toggled_on":
            return self._words.fact("toggled_on", tool)
        return disjunction(
            self._words.fact("saturated", tool, one) for one in self._task.kinds if category(one) == substance
        )

    def _moved_contents(
        self, substances: Sequence[str], vessel: str, *fact: str
    ) -> tuple[str, list[Variant]]:
        """Something of the substances is in the vessel, and whatever is in it makes the fact of it true."""
        held = {one: self._words.fact("contains", vessel, one) for one in substances}
        changes = [Variant(is_in, self._words.fact_effect(TRUE, *fact, one)) for one, is_in in held.items()]
        return disjunction(held.values()), changes

    def _soak_inside(self, tool: str, vessel: str) -> tuple[list[str], list[Variant]]:
        substances = soaked_up(self._task, tool, self._words.contents(vessel))
        some, changes = self._moved_contents(substances, vessel, "saturated", tool)
        return [self._able(vessel, "fillable"), self._reachable(tool), self._reachable(vessel), some], changes

    def _soak_under(self, tool: str, source: str) -> tuple[list[str], list[Variant]]:
        substances = soaked_up(self._task, tool, sources(self._task, source))
        needs = [TRUE if substances else FALSE, self._is_running(source), self._reachable(tool)]
        return needs, [change for one in substances for change in self._set(TRUE, "saturated", tool, one)]

    def _fill_with(self, vessel: str, source: str) -> tuple[list[str], list[Variant]]:
        substances = sources(self._task, source)
        needs = [self._able(vessel, "fillable"), TRUE if substances else FALSE]
        needs += [self._is_running(source), self._reachable(vessel)]
        return needs, [change for one in substances for change in self._set(TRUE, "contains", vessel, one)]

    def _pour_into(self, vessel: str, target: str) -> tuple[list[str], list[Variant]]:
        some, changes = self._moved_contents(self._words.contents(vessel), vessel, "contains", target)
        needs = [self._able(one, "fillable") for one in (vessel, target)]
        return [*needs, self._reachable(target), self._reachable(vessel), some], changes

    def _spread(self, vessel: str, target: str) -> tuple[list[str], list[Variant]]:
        how = "saturated" if self._task.has(target, "cloth") else "covered"
        some, changes = self._moved_contents(self._words.contents(vessel), vessel, how, target)
        needs = [self._able(vessel, "fillable"), self._reachable(vessel), self._reachable(target), some]
        return needs, changes

    def _wait(self, thing: str) -> tuple[list[str], list[Variant]]:
        return [], [*self._set(FALSE, "frozen", thing), *self._set(FALSE, "hot", thing)]

    def _wait_for_cooked(self, thing: str) -> tuple[list[str], list[Variant]]:
        if self._task.is_substance(thing):
            return self._cook_substance(thing)
        if self._task.has(thing, "cookable"):
            changes = [*self._set(TRUE, "cooked", thing), *self._set(TRUE, "hot", thing)]
            return [self._is_heated(thing)], [*changes, *self._set(FALSE, "frozen", thing)]
        needs, changes = [], []
        for content in self._words.contents(thing):
            held = self._words.fact("contains", thing, content)
            cooked = cooked_form(self._task, content)
            needs.append(disjunction((negation(held), FALSE if cooked is None else self._is_heated(thing))))
            if cooked is not None:
                changes.append(Variant(held, self._cooked_effects(thing, content, cooked)))
        return needs, changes

    def _cook_substance(self, thing: str) -> tuple[list[str], list[Variant]]:
        cooked = cooked_form(self._task, thing)
        needs: list[str] = []
        changes: list[Variant] = []
        before: list[str] = []
        for vessel in self._task.kinds:
            held = self._words.fact("contains", vessel, thing)
            first = conjunction((held, *map(negation, before)))
            needs.append(conjunction((first, self._is_heated(vessel))))
            if cooked is not None and first != FALSE:
                changes.append(Variant(first, self._cooked_effects(vessel, thing, cooked)))
            before.append(held)
        return [FALSE if cooked is None else disjunction(needs)], changes

    def _cooked_effects(self, vessel: str, raw: str, cooked: str) -> Effects:
        return {
            **self._words.fact_effect(FALSE, "contains", vessel, raw),
            **self._words.fact_effect(TRUE, "contains", vessel, cooked),
            **self._words.fact_effect(TRUE, "real", cooked),
        }

    def _wait_for_washed(self, machine: str) -> tuple[list[str], list[Variant]]:
        inside = {thing: self._words.is_inside(thing, machine) for thing in self._task.kinds}
        dirt = {
            thing: [self._words.fact("covered", thing, one) for one in self._words.coverings(thing)]
            for thing in inside
        }
        needs = [
            TRUE if "washer" in category(self._task.kinds[machine]) else FALSE,
            negation(self._words.fact("open", machine)),
            self._words.fact("toggled_on", machine),
            disjunction(inside.values()),
            *(disjunction((negation(is_in), *dirt[thing])) for thing, is_in in inside.items()),
        ]
        changes = [
            Variant(is_in, self._words.fact_effect(FALSE, "covered", thing, one))
            for thing, is_in in inside.items()
            for one in self._words.coverings(thing)
        ]
        return needs, changes

    def _wait_for_frozen(self, thing: str, place: str) -> tuple[list[str], list[Variant]]:
        is_cold = "refrigerator" in place and self._task.has(thing, "freezable")
        needs = [TRUE if is_cold else FALSE, self._words.is_inside(thing, place)]
        return needs, self._set(TRUE, "frozen", thing)


def _variants(changes: Sequence[Variant], *, has_effect: bool) -> Iterator[Variant]:
    """Yield a skill for each combination of the changes that depend on the state.

    Args:
        changes: the changes.
        has_effect: the needs say that there is a change.
    """
    together: dict[str, dict[str, str]] = {}
    for change in changes:
        if change.condition != FALSE and change.effects:
            together.setdefault(change.condition, {}).update(change.effects)
    always = together.pop(TRUE, {})
    if len(together) > MAX_CONDITIONAL_EFFECTS:
        raise UnsupportedError(f"{len(together)} effects of one action depend on the state")
    for chosen in product((True, False), repeat=len(together)):
        if has_effect and not always and together and not any(chosen):
            continue
        effects = dict(always)
        conditions = []
        for (condition, more), is_true in zip(together.items(), chosen, strict=True):
            conditions.append(condition if is_true else negation(condition))
            effects |= more if is_true else {}
        yield Variant(conjunction(conditions), effects)
