"""Action kinds with their risk, and the rules of Φ that govern them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, RealType, Type, VectorType
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, TIME
from aeros.spec.model.tools import Tool
from aeros.spec.model.variables import Declared


class Risk(IntEnum):
    """Ordered levels of risk. A skill's risk is at least that of every action kind it asks for."""

    LOW = 1
    MEDIUM = 2
    HIGH = 3


@dataclass(frozen=True)
class ActionKind:
    """Kind of action that the site declares.

    Attributes:
        name: its name.
        actuators: actuators that it moves.
        risk: least risk that it carries.
        protective: True for the protective stop, which every state must allow.
        parameters: declared parameters by name.
        span: place in the site file.
        tool: service that carries it out; None if the robot does.
        means: action of the simulators that it is, where the site has another word for it; None for the same.
    """

    name: str
    actuators: frozenset[str]
    risk: Risk
    protective: bool
    parameters: Mapping[str, Declared]
    span: SourceSpan
    tool: Tool | None = None
    means: str | None = None

    @property
    def plant_word(self) -> str:
        """Name by which a plant that says its action kinds knows it."""
        return self.means or self.name

    @property
    def channels(self) -> frozenset[str]:
        """Channels that its tool uses."""
        channel = None if self.tool is None else self.tool.channel
        return frozenset() if channel is None else frozenset((channel,))


SIMULATED_ACTIONS: Final[Mapping[str, Mapping[str, Type]]] = {
    "stop": {},
    "wait": {"duration": RealType(TIME)},
    "look": {"camera": EnumType("cameras", ())},
    "move_tool": {
        "target": VectorType(LENGTH),
        "yaw": RealType(ANGLE),
        "speed": RealType(LENGTH * TIME**-1),
    },
    "move_joints": {
        **{f"q{number}": RealType(ANGLE) for number in range(1, 8)},
        "speed": RealType(LENGTH * TIME**-1),
    },
    "slide": {
        "target": VectorType(LENGTH),
        "force": RealType(FORCE),
        "speed": RealType(LENGTH * TIME**-1),
    },
    "grip": {"width": RealType(LENGTH), "force": RealType(FORCE)},
    "move_base": {
        "x": RealType(LENGTH),
        "y": RealType(LENGTH),
        "speed": RealType(LENGTH * TIME**-1),
    },
}
"""Action kinds of the simulated robot, with the type of each parameter; any cameras will do."""


def parameter_differences(kind: ActionKind, word: str) -> list[str]:
    """Compare the parameters of an action kind with those of a simulated one.

    Args:
        kind: action kind of a site.
        word: name of the simulated action kind.

    Returns:
        A text for each parameter that is missing, too many, or of another type or dimension.
    """
    expected = SIMULATED_ACTIONS[word]
    found = {name: one.variable.type for name, one in kind.parameters.items()}
    return [
        *(f"`{name}` is missing ({one})" for name, one in expected.items() if name not in found),
        *(f"`{name}` is too many" for name in found if name not in expected),
        *(
            f"`{name}` is {found[name]}, and not {one}"
            for name, one in expected.items()
            if name in found and _kind_of_type(found[name]) != _kind_of_type(one)
        ),
    ]


def _kind_of_type(one: Type) -> object:
    """Return an enum's name, as its members are the site's, and any other type as it is."""
    return one.name if isinstance(one, EnumType) else one


@dataclass(frozen=True)
class Conjunct:
    """One of the conditions that a larger one is the conjunction of.

    Attributes:
        term: the condition.
        span: its place in the file.
    """

    term: t.Term
    span: SourceSpan


@dataclass(frozen=True)
class Rule:
    """Invariant of Φ, as a term for each action kind it governs.

    Attributes:
        id: name of the rule in the site.
        text: the condition as written.
        rationale: reason for the rule.
        source: standard or measurement that it comes from; may be empty.
        terms: by action kind, the condition on state and action.
        span, require_span: places of the rule and of its condition in the site file.
        attenuations: by action kind, the term that each reducible parameter is set to when only this rule
            denies; of a vector, the length to which it is shortened if it is longer.
        conjuncts: by action kind, the conditions that its term is the conjunction of.
        premises: by action kind; the rule denies a state and action that make all premises true and all
            alternatives false.
        alternatives: by action kind, see `premises`.
    """

    id: str
    text: str
    rationale: str
    source: str
    terms: Mapping[str, t.Term]
    attenuations: Mapping[str, Mapping[str, t.Term]]
    span: SourceSpan
    require_span: SourceSpan
    conjuncts: Mapping[str, tuple[Conjunct, ...]] = field(default_factory=dict)
    premises: Mapping[str, tuple[Conjunct, ...]] = field(default_factory=dict)
    alternatives: Mapping[str, tuple[Conjunct, ...]] = field(default_factory=dict)

    def constrains_action(self, kind: str) -> bool:
        """Say if the rule constrains the action itself, not only the state in which it is asked for.

        Args:
            kind: action kind that the rule governs.

        Returns:
            True if the rule reads a parameter of the action, or no variable at all.
        """
        roles = {variable.role for variable in t.variables_of(self.terms[kind]).values()}
        return t.VariableRole.PARAMETER in roles or not roles


@dataclass(frozen=True)
class JointRule:
    """Invariant about two simultaneous actions. A parameter `p` of the role `a` is the variable `a.p`.

    Attributes:
        id, text, rationale, source, span, require_span: as of a `Rule`.
        term: the condition on the state and both actions.
        roles: the two roles, in order, and the action kind of each.
        conjuncts: the conditions that the term is the conjunction of.
    """

    id: str
    text: str
    rationale: str
    source: str
    roles: tuple[tuple[str, str], tuple[str, str]]
    term: t.Term
    span: SourceSpan
    require_span: SourceSpan
    conjuncts: tuple[Conjunct, ...] = ()
