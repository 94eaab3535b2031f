"""Action spaces of an environment: which skill runs next, and with which inputs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from gymnasium import spaces

from aeros.session.argument_checks import require_one_of
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.types import BoolType, EnumType, IntegerType, RealType, VectorType
from aeros.spec.model.ecm import Ecm, Skill, Task
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.variables import Declared

ActionSpaceName = Literal["skills", "skills-with-inputs", "requests"]
"""`skills`: a number chooses a skill, whose inputs are those of the task's rules or the defaults.
`skills-with-inputs`: the inputs of the skill are chosen, too.
`requests`: a single action of the site, such as a target of the tool, is asked for in the name of a skill."""


Bounds = Mapping[str, tuple[Any, Any]]
"""Least and greatest value (SI) of numbers that an action chooses, by name; triples for vectors."""


class ChosenStep(NamedTuple):
    """A step that an action asks for.

    Attributes:
        choice: the skill.
        inputs: its inputs (SI) by name.
        request: the action that takes the place of the skill's code; None to run the code.
    """

    choice: SkillChoice
    inputs: Mapping[str, Any]
    request: Action | None = None


class Decoder(Protocol):
    """Decoder of an environment's actions.

    Attributes:
        choices: the skills that the space can choose.
        space: the action space.
    """

    choices: tuple[SkillChoice, ...]
    space: spaces.Space[Any]

    def decode(self, action: Any) -> ChosenStep:
        """Decode an action.

        Args:
            action: a member of `space`.

        Returns:
            The step that it asks for.
        """


class SkillChoice(NamedTuple):
    """A skill that an action can choose.

    Attributes:
        module: id of its module.
        skill: the skill.
        inputs: values (SI) that it gets unless the action gives them: of the task's rule, or defaults.
    """

    module: str
    skill: Skill
    inputs: Mapping[str, Any]

    @property
    def name(self) -> str:
        """`MODULE.SKILL`."""
        return f"{self.module}.{self.skill.id}"


def skill_choices(modules: Mapping[str, Ecm], owner: str, task: Task) -> tuple[SkillChoice, ...]:
    """List the skills that an agent may choose.

    Args:
        modules: the modules of the environment, by id.
        owner: id of the task's module.
        task: the task, whose rules say inputs.

    Returns:
        All skills of all modules, in the order of their declaration.
    """
    by_rule = {(owner, rule.skill): rule.inputs for rule in reversed(task.rules)}
    found = []
    for module, ecm in modules.items():
        for skill in ecm.skills.values():
            defaults = {name: one.default_value for name, one in skill.inputs.items()}
            given = {**defaults, **by_rule.get((module, skill.id), {})}
            inputs = {name: value for name, value in given.items() if value is not None}
            found.append(SkillChoice(module, skill, inputs))
    return tuple(found)


class _Part:
    """Value of an input or a parameter as a part of an action.

    Args:
        name: name in the action.
        declared: its type and range.
        bounds: least and greatest value (SI) that can be chosen, by name; by default the declared range.

    Attributes:
        space: of numbers, [-1, 1] for the bounds; None for a family, which an action cannot choose.
    """

    def __init__(self, name: str, declared: Declared, bounds: Bounds) -> None:
        self._type = declared.variable.type
        self.space: spaces.Space[Any] | None = None
        least, greatest = declared.double_range
        self._low, self._high = np.broadcast_arrays(
            *(np.asarray(one) for one in bounds.get(name, (least, greatest)))
        )
        if name in bounds and not isinstance(self._type, RealType | VectorType):
            raise MisuseError(f"`{name}` is no real number, so it has no bounds")
        match self._type:
            case BoolType():
                self.space = spaces.Discrete(2)
            case EnumType(members=members):
                self.space = spaces.Discrete(len(members))
            case IntegerType():
                self.space = spaces.Discrete(int(greatest) - int(least) + 1, start=int(least))
            case RealType() | VectorType():
                shape = (3,) if isinstance(self._type, VectorType) else (1,)
                if self._low.shape not in ((), shape) or not np.all(
                    (least <= self._low) & (self._low <= self._high) & (self._high <= greatest)
                ):
                    raise MisuseError(
                        f"the bounds of `{name}` are {bounds[name]}; give (least, greatest), numbers or "
                        f"triples within [{least:g}, {greatest:g}]"
                    )
                self.space = spaces.Box(-1.0, 1.0, shape=shape, dtype=np.float64)
            case _:
                pass

    def value(self, chosen: Any) -> Any:
        """Convert a member of `space` to a value, SI."""
        match self._type:
            case BoolType():
                return bool(chosen)
            case EnumType(members=members):
                return members[int(chosen)]
            case IntegerType():
                return int(chosen)
        # A sum of products that gives each bound exactly.
        share = (1.0 + np.asarray(chosen)) / 2.0
        found = np.clip((1.0 - share) * self._low + share * self._high, self._low, self._high)
        return tuple(found.tolist()) if isinstance(self._type, VectorType) else float(found[0])


class SkillDecoder:
    """Decoder of actions that choose a skill; implements `Decoder`.

    Args:
        choices: the skills.  Without inputs to choose, a skill that needs one which neither a rule nor a
            default gives is left out.
        with_inputs: True to choose the inputs, too.
        bounds: of inputs, by `MODULE.SKILL.INPUT`.
    """

    def __init__(self, choices: Sequence[SkillChoice], bounds: Bounds, *, with_inputs: bool) -> None:
        self._inputs: dict[str, dict[str, _Part]] = {}
        self.choices = tuple(choices)
        self.space: spaces.Space[Any]
        if not with_inputs:
            _require_known(bounds, ())
            self.choices = tuple(one for one in choices if one.inputs.keys() == one.skill.inputs.keys())
            self.space = spaces.Discrete(len(self.choices))
            return
        parts: dict[str, spaces.Space[Any]] = {"skill": spaces.Discrete(len(self.choices))}
        for choice in self.choices:
            declared = choice.skill.inputs.items()
            own = {name: _Part(f"{choice.name}.{name}", one, bounds) for name, one in declared}
            self._inputs[choice.name] = {name: one for name, one in own.items() if one.space is not None}
            parts |= {
                f"{choice.name}.{name}": one.space for name, one in own.items() if one.space is not None
            }
        _require_known(bounds, parts)
        self.space = spaces.Dict(parts)

    def decode(self, action: Any) -> ChosenStep:
        """Implement `Decoder.decode`."""
        if isinstance(self.space, spaces.Discrete):
            choice = self.choices[int(action)]
            return ChosenStep(choice, choice.inputs)
        choice = self.choices[int(action["skill"])]
        own = self._inputs[choice.name].items()
        given = {name: part.value(action[f"{choice.name}.{name}"]) for name, part in own}
        return ChosenStep(choice, {**choice.inputs, **given})


class RequestDecoder:
    """Decoder of actions that ask for one action of the site; implements `Decoder`.

    Args:
        choice: the skill in whose name they are asked for.
        kinds: action kinds of the site, by name.
        bounds: of parameters, by `KIND.PARAMETER`.

    Attributes:
        kind_names: names of the action kinds, in the order of `kind`.
    """

    def __init__(self, choice: SkillChoice, kinds: Mapping[str, ActionKind], bounds: Bounds) -> None:
        self.choices: tuple[SkillChoice, ...] = (choice,)
        self._parameters: dict[str, dict[str, _Part]] = {}
        for kind in (kinds[name] for name in choice.skill.envelope):
            own = {name: _Part(f"{kind.name}.{name}", one, bounds) for name, one in kind.parameters.items()}
            if all(one.space is not None for one in own.values()):
                self._parameters[kind.name] = own
        self.kind_names = tuple(self._parameters)
        parts: dict[str, spaces.Space[Any]] = {"kind": spaces.Discrete(len(self.kind_names))}
        for kind_name, own in self._parameters.items():
            parts |= {f"{kind_name}.{name}": one.space for name, one in own.items() if one.space is not None}
        _require_known(bounds, parts)
        self.space: spaces.Space[Any] = spaces.Dict(parts)

    def decode(self, action: Any) -> ChosenStep:
        """Implement `Decoder.decode`."""
        kind = self.kind_names[int(action["kind"])]
        own = self._parameters[kind].items()
        parameters = {name: part.value(action[f"{kind}.{name}"]) for name, part in own}
        (choice,) = self.choices
        return ChosenStep(choice, choice.inputs, Action(kind, parameters))


def _require_known(bounds: Bounds, names: Iterable[str]) -> None:
    for one in bounds:
        require_one_of("number to bound", one, tuple(names))
