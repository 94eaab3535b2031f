"""Stop of a part of a composition inside the agent's loop, as long as few states may follow."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.consequences.disturbance import Definitions
from aeros.spec.consequences.stopped_parts import stop_of_part
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import IntegerType
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import ActionCondition, Skill
from aeros.spec.model.hold_conditions import MAX_COMBINATIONS, count_combinations
from aeros.spec.model.step_graph import StoppablePart
from aeros.spec.model.variables import Declared


def stop_in_loop(
    part: StoppablePart[Step],
    composition: Composition,
    skills: Mapping[str, Skill],
    state: Mapping[str, Declared],
    definitions: Definitions,
) -> Skill:
    """Describe the stop of a part as a skill that only fails.

    Args:
        part: a part of the composition.
        composition: the composition.
        skills: skills that the module may run, by name, with the consequences of their outcomes.
        state: state variables of the site by name.
        definitions: definitions of predicates by full name.

    Returns:
        The skill.

    Raises:
        StateSpaceError: more than `MAX_COMBINATIONS` combinations of values are open after the stop.
    """
    handlers = composition.handlers
    stop = stop_of_part(part, handlers, skills, state, definitions)
    changing = {
        name: state[name]
        for one in skills.values()
        for outcome in one.outcomes.values()
        for name in outcome.effects
    }
    if stop.hold_condition is not None and _combinations(stop.hold_condition, changing) > MAX_COMBINATIONS:
        raise StateSpaceError(f"a part of `{composition.id}` that may be stopped leaves too much open")
    return stop


def _combinations(hold: ActionCondition, changing: Mapping[str, Declared]) -> int:
    """Count the combinations of values of predicates, and of whole numbers that a skill sets.

    A whole number without a range counts once: the loop is refused for it elsewhere.
    """
    numbers = 1
    for name, one in t.variables_of(hold.term).items():
        bounds = changing[name].range if name in changing else None
        if isinstance(one.type, IntegerType) and bounds is not None:
            numbers *= int(bounds[1]) - int(bounds[0]) + 1
    return count_combinations(hold) * numbers
