"""Stop of a part of a composition inside the agent's loop, as long as few states may follow."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.consequences.disturbance import Definitions
from aeros.spec.consequences.stopped_parts import parallel_skills, stop_of_part
from aeros.spec.expr.types import IntegerType
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Skill
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
        StateSpaceError: too much is open after the stop: a whole number that parallel steps set, or more than
            `MAX_COMBINATIONS` combinations of values.
    """
    handlers = composition.handlers
    stop = stop_of_part(part, handlers, skills, state, definitions)
    sets_number = any(
        isinstance(state[name].variable.type, IntegerType)
        for one in parallel_skills(part, handlers, skills)
        for outcome in one.outcomes.values()
        for name in outcome.effects
    )
    many = stop.hold_condition is not None and count_combinations(stop.hold_condition) > MAX_COMBINATIONS
    if sets_number or many:
        raise StateSpaceError(f"a part of `{composition.id}` that may be stopped leaves too much open")
    return stop
