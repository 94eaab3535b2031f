"""Stop of a part in its midst, as an invocation: what it leaves open beyond what its steps have done.

A step that is stopped has done nothing, or all of one of its outcomes (`aeros.spec.model.hold_conditions`).
Where steps run at the same time, each may have come to any point, so all that they may set is open.  A lost
condition is restored or not by then: what it reads is open, as after the lost hold-condition of a skill.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from aeros.spec.consequences.disturbance import Definitions, disturbed_by_changes
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Step, handlers_of
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.hold_conditions import STOPPED
from aeros.spec.model.rules import Risk
from aeros.spec.model.step_graph import HeldPart, Par, StoppablePart, steps_of, walk_parts
from aeros.spec.model.variables import Declared


def stop_of_part(
    part: StoppablePart[Step],
    handlers: Mapping[str, Step],
    skills: Mapping[str, Skill],
    state: Mapping[str, Declared],
    definitions: Definitions,
) -> Skill:
    """Describe the stop of a part as a skill that only fails.

    Args:
        part: the part.
        handlers: handlers of its composition by name.
        skills: skills that the module may run, by name, with the consequences of their outcomes.
        state: state variables of the site by name.
        definitions: definitions of predicates by full name.

    Returns:
        A skill whose outcome has no effects, and whose hold-condition reads what the stop leaves open.
    """
    read: dict[str, t.Variable] = {}
    if isinstance(part, HeldPart):
        variables = t.variables_of(part.condition.term)
        read |= {name: one for name, one in variables.items() if one.role is t.VariableRole.STATE}
    disturbed = disturbed_by_changes(read, definitions)
    parallel = parallel_skills(part, handlers, skills)
    for skill in parallel:
        disturbed |= skill.disturbed
        for outcome in skill.outcomes.values():
            names = (*outcome.effects, *(one.variable for one in outcome.ranges))
            read |= {name: state[name].variable for name in names}
    condition = ActionCondition(t.And(tuple(read.values())), "", part.span) if read else None
    envelope = {kind: one for skill in parallel for kind, one in skill.envelope.items()}
    return Skill(
        id=STOPPED,
        module_name="",
        function="",
        inputs={},
        precondition=None,
        outcomes={STOPPED: Outcome(STOPPED, {}, True, Fraction(1), None)},
        envelope=envelope,
        actuators=frozenset().union(*(one.actuators for one in parallel)),
        resources=frozenset(),
        risk=Risk.LOW,
        timeout=Fraction(0),
        runtime_checked={},
        span=part.span,
        risk_span=part.span,
        entry_span=part.span,
        hold_condition=condition,
        disturbed=disturbed,
    )


def parallel_skills(
    part: StoppablePart[Step], handlers: Mapping[str, Step], skills: Mapping[str, Skill]
) -> list[Skill]:
    """List the skills that may run at the same time inside a part.

    Args:
        part: the part.
        handlers: handlers of its composition by name.
        skills: skills that the module may run, by name.

    Returns:
        The skills of all steps in a `par` inside it, their handlers included, each once.
    """
    branches = (one for par in walk_parts(part.part) if isinstance(par, Par) for one in par.branches)
    steps = (step for branch in branches for step in steps_of(branch))
    runs = (run for step in steps for run in (step, *handlers_of(step, handlers)))
    names = dict.fromkeys(name for run in runs for name in run.runs)
    return [skills[name] for name in names]
