"""Context of a step's ending: what must agree before a record is evidence for another try.

It consists of the task, the digest of the module's code and parameters (the record of another version, or
with other values, says little), and the measured predicates that the preconditions of the step's skills
read. If the step names a capability, these are the preconditions of all providers, so that their records
are about the same situations. Where a task says the kind of a thing, as of the object to be held, the kind
agrees, too. Inputs and quantities are left out, because they seldom repeat.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from aeros.agent.world.world import WorldModel
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, Skill


def evidence_context(
    task: str, module: Ecm, skills: Iterable[Skill], world: WorldModel, others: Iterable[Ecm] = ()
) -> str:
    """Encode the context of a step that may run any of `skills`.

    Args:
        task: task as MODULE.TASK.
        module: module that is asked.
        skills: skills that may run.
        world: current state.
        others: further modules of which skills may run.

    Returns:
        Canonical JSON; two texts are equal iff the contexts are.
    """
    others = tuple(others)
    conditions = [skill.precondition.term for skill in skills if skill.precondition is not None]
    read = {name for term in conditions for name in t.variables_of(term)}
    read |= {thing.kind_from for one in (module, *others) for thing in one.things.values() if thing.kind_from}
    predicates = {name: world.predicates[name] for name in read & world.predicates.keys()}
    code = " ".join([module.behaviour_digest, *sorted({one.behaviour_digest for one in others})])
    return json.dumps({"task": task, "code": code, "predicates": predicates}, sort_keys=True)


def context_in_any_state(task: str, module: Ecm) -> str:
    """Encode all contexts of the steps of a task that run a module's code, whatever is measured.

    A composition is chosen where its first step starts, and its other steps start elsewhere.

    Args:
        task: task as MODULE.TASK.
        module: module that has the skill.

    Returns:
        Canonical JSON without predicates; `evidence` lets every context with the task and the code agree.
    """
    return json.dumps({"task": task, "code": module.behaviour_digest}, sort_keys=True)
