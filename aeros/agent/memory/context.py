"""The context that a step's ending is evidence of: what must agree before a record speaks of the next try.

It is the task; the code of the module, as what another version did says little of this one; and what is
measured of the predicates that the preconditions of the step's skills read, those of all providers where
the step names a capability, so that the records of its providers are of the same situations.
Left out: inputs and quantities, which seldom come twice.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from aeros.agent.world.world import WorldModel
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Ecm, Skill


def evidence_context(task: str, module: Ecm, skills: Iterable[Skill], world: WorldModel) -> str:
    """The context of a step that may run any of `skills`, as text that is equal iff the contexts are."""
    conditions = [skill.precondition.term for skill in skills if skill.precondition is not None]
    read = {name for term in conditions for name in t.variables_of(term)}
    predicates = {name: world.predicates[name] for name in read & world.predicates.keys()}
    return json.dumps({"task": task, "code": module.code_digest, "predicates": predicates}, sort_keys=True)
