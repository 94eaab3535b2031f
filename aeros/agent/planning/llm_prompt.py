"""Planning domains as language models read them: skills as JSON values, and the JSON Schema of plans."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.agent.world.values import effects_for_reading
from aeros.spec.planning.domain import GroundSkill, PlanningDomain

PLAN_REFERENCE: Final[Mapping[str, Any]] = {"$ref": "#/$defs/plan"}
"""Schema of a plan inside of a schema that `with_plans` makes."""

PLAN_FORM: Final = """\
A plan is a list of parts that are carried out in order. A part is either a step,
{"skill": NAME, "inputs": {...}, "retry": N, "between_tries": NAME or null, "on_failure": NAME or null}, or
a fork, {"if": CONDITION, "then": PLAN, "else": PLAN or null}.
"skill" is one of the names given, "inputs" has exactly the inputs given for it. A step is repeated up to
"retry" times where it fails; before each repetition the skill "between_tries" runs. Where the last repetition
fails, too, the skill "on_failure" runs. Both are named without their module if it is that of the step.
CONDITION is an expression over the names in "measured", with `and`,
`or`, `not`, `==` and brackets.
A skill starts only where its "needs" is measured as true. Afterwards one of its outcomes is measured, which
sets the values that it lists. Where a step fails for good the plan ends, and you are asked again; so a plan
need not provide for failures beyond "retry", "between_tries" and "on_failure". Whatever successes steps have,
every later step must be able to start, and the goal must hold at the end.\
"""
"""Form of a plan, in words for a model."""


def skills_of(domain: PlanningDomain) -> dict[str, list[GroundSkill]]:
    """Collect the choices of each skill.

    Args:
        domain: planning domain.

    Returns:
        Choices, one for each combination of inputs without default, by MODULE.SKILL.
    """
    found: dict[str, list[GroundSkill]] = {}
    for choice in domain.choices:
        found.setdefault(choice.name, []).append(choice)
    return found


def describe_skill(choices: list[GroundSkill]) -> dict[str, Any]:
    """Describe a skill as JSON values: name, inputs, precondition and outcomes.

    Args:
        choices: the choices of one skill.

    Returns:
        JSON values.
    """
    choice, clause = choices[0], choices[0].skill.precondition
    return {
        "skill": choice.name,
        "inputs": _inputs(choices),
        "needs": "true" if clause is None else clause.text,
        "outcomes": [
            {
                "outcome": one.id,
                "is_failure": one.failure,
                "sets": effects_for_reading(one),
            }
            for one in choice.skill.outcomes.values()
            if one.probability != 0
        ],
    }


def _inputs(choices: list[GroundSkill]) -> dict[str, list[Any]]:
    """List the values that each input without default may have."""
    return {name: list(dict.fromkeys(one.inputs[name] for one in choices)) for name in choices[0].inputs}


def answer_schema(domain: PlanningDomain, retries: int) -> dict[str, Any]:
    """Make the JSON Schema of answers, which servers with structured output enforce.

    Args:
        domain: planning domain of the task.
        retries: maximum number of retries of a step.

    Returns:
        The schema as JSON values.
    """
    return with_plans({"plan": PLAN_REFERENCE}, domain, retries)


def with_plans(properties: Mapping[str, Any], domain: PlanningDomain, retries: int) -> dict[str, Any]:
    """Make the JSON Schema of an object whose properties may refer to plans by `PLAN_REFERENCE`.

    Args:
        properties: schema of each property; all are required.
        domain: planning domain whose skills the plans use.
        retries: maximum number of retries of a step.

    Returns:
        The schema as JSON values.
    """
    steps = [_step_schema(name, choices, domain, retries) for name, choices in skills_of(domain).items()]
    plan = PLAN_REFERENCE
    fork = object_schema(
        {"if": {"type": "string"}, "then": plan, "else": {"anyOf": [plan, {"type": "null"}]}}
    )
    parts = {"type": "array", "items": {"anyOf": [*steps, fork]}}
    return {**object_schema(properties), "$defs": {"plan": parts}}


def _step_schema(
    name: str, choices: list[GroundSkill], domain: PlanningDomain, retries: int
) -> dict[str, Any]:
    module = choices[0].module
    helpers = {one.skill.id if one.module == module else one.name for one in domain.choices if not one.inputs}
    helper = {"anyOf": [{"type": "string", "enum": sorted(helpers)}, {"type": "null"}]}
    return object_schema(
        {
            "skill": {"type": "string", "enum": [name]},
            "inputs": object_schema({key: {"enum": values} for key, values in _inputs(choices).items()}),
            "retry": {"type": "integer", "enum": [*range(retries + 1)]},
            "between_tries": helper,
            "on_failure": helper,
        }
    )


def object_schema(properties: Mapping[str, Any]) -> dict[str, Any]:
    """Make the JSON Schema of an object that has exactly the given properties.

    Args:
        properties: schema of each property.

    Returns:
        The schema as JSON values.
    """
    return {
        "type": "object",
        "properties": dict(properties),
        "required": list(properties),
        "additionalProperties": False,
    }
