"""Arguments that a step gives its skill: constants, and outputs of earlier steps as variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.effects import Increment
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.composition import Step
from aeros.spec.model.ecm import Skill
from aeros.spec.model.variables import Declared


@dataclass(frozen=True)
class Arguments:
    """The arguments of a step.

    Attributes:
        terms: term of each input, by the name of the input's variable.
        variables: variables that these terms bring in.
    """

    terms: Mapping[str, t.Term]
    variables: tuple[Declared, ...]


def step_arguments(
    step: Step, sources: Mapping[str, Step], skills: Mapping[str, Skill], run: str | None = None
) -> Arguments:
    """Build the arguments of a step; an output `x` of the step `s` becomes the variable `s.x`.

    An output whose type does not fit the input is refused elsewhere.  Here such an input may have any value
    that its declaration admits.

    Args:
        step: step or handler of a composition.
        sources: steps of the composition by id.
        skills: skills that the module may run, by name.
        run: the skill that runs; by default the first that may.

    Returns:
        The term of each input, and the variables in these terms.
    """
    terms: dict[str, t.Term] = {}
    declared: list[Declared] = []
    for name, one in skills[run or step.runs[0]].inputs.items():
        flow = step.output_references.get(name)
        if flow is None:
            value = step.inputs.get(name, one.default_value)
            terms[one.name] = constant_term(value, one.variable.type)
            continue
        outputs = [skills[source].outputs[flow.output] for source in sources[flow.step].runs]
        output = outputs[0]
        fits = all(each.variable.type == one.variable.type for each in outputs) and (
            len({each.range for each in outputs}) == 1
        )
        brought, called = (output, f"{flow.step}.{flow.output}") if fits else (one, f"{step.id}.{name}")
        declared.append(replace(brought, variable=replace(brought.variable, name=called)))
        terms[one.name] = declared[-1].variable
    return Arguments(terms, tuple(declared))


def effect_term(effect: Any, variable: t.Variable) -> t.Term:
    """Make a term of the value that an effect leaves.

    Args:
        effect: a value, or an increment.
        variable: the variable, which stands for its value before.

    Returns:
        A constant, or the variable and a number.
    """
    if isinstance(effect, Increment):
        return t.Add(variable, t.Literal(effect.amount, RealType(NUMBER)))
    return constant_term(effect, variable.type)
