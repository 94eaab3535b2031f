"""Names that conditions of a scene may use, and the elaboration of these conditions.

The names are dotted: `can.position`, `press.hinge`, `cooking.longest`, `dirt.wiped`. `can.position in pot`
asks for a region, which may move; it is a boolean variable of that very name. `dirt.left.wiped` is the wiped
share of the part of a coating that is in the region `left`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields, replace
from typing import Any, Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_expression
from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError
from aeros.spec.expr.parser import parse as parse_expression
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.name_resolution import suggest_names
from aeros.spec.expr.types import BOOL, RealType, Type, VectorType
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, NUMBER, TIME
from aeros.spec.model.scene import (
    Basin,
    BodyPart,
    ForceInstrument,
    Instrument,
    JointInstrument,
    LoadInstrument,
    PositionInstrument,
    Scene,
    SceneBody,
    SceneCondition,
    UrdfModel,
)
from aeros.spec.text.fields import ExpressionField, TextField

_POINT: Final = VectorType(LENGTH)
_ROTATION: Final = RealType(ANGLE)
_IN: Final = " in "
_NO_ALIASES: Final[Mapping[str, str]] = {}


def is_membership(variable: str) -> bool:
    """Say if a variable is the membership of a point in a region.

    Args:
        variable: name of a variable.

    Returns:
        True for `POINT in REGION`.
    """
    return _IN in variable


def membership(variable: str) -> tuple[str, str]:
    """Split the name of a membership.

    Args:
        variable: `POINT in REGION`.

    Returns:
        Names of the point's variable and of the region.
    """
    point, _, region = variable.partition(_IN)
    return point, region


class SceneScope:
    """Variables of a scene by name, and the elaboration of conditions over them.

    Args:
        scene: the scene, whose conditions need not be there yet.
        diagnostics: receives the faults.
    """

    def __init__(self, scene: Scene, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics
        self._types = dict(_types(scene))
        self._regions = region_names(scene)
        self._conditions = {name: name for name in (*scene.conditions, *scene.seals, *scene.truth)}
        for timer in scene.timers:
            self.add_timer(timer)

    def depends_on(self, expression: ExpressionField, names: Collection[str]) -> set[str]:
        """List the names that an expression uses.

        Args:
            expression: the field.
            names: names to look for.

        Returns:
            Those of `names` that stand in it, with or without an attribute; none if it is malformed.
        """
        try:
            node = parse_expression(expression.value)
        except ExpressionSyntaxError:
            return set()
        return {one for one in _names_in(node) if one in names}

    def add_condition(self, name: str, full_name: str = "") -> None:
        """Make a condition known to those after it.

        Args:
            name: of a condition, of a seal, which is true once it is sealed, or of a truth.
            full_name: of the truth of a module's variable, as in `kettle.water_hot`; empty if it has none.
        """
        self._conditions[name] = full_name or name

    def add_timer(self, name: str) -> None:
        """Make a timer known to the conditions after it.

        Args:
            name: of the timer.
        """
        self._types[name] = self._types[f"{name}.longest"] = RealType(TIME)

    def condition(
        self,
        expression: ExpressionField,
        aliases: Mapping[str, str] = _NO_ALIASES,
        expected: Type = BOOL,
    ) -> SceneCondition | None:
        """Elaborate a condition, or a number.

        Args:
            expression: the field.
            aliases: names that stand for things of the scene, with the names of these.
            expected: the type that it must have.

        Returns:
            The condition; None after reporting its fault.
        """
        types: dict[str, Type] = {**self._types, **dict.fromkeys(self._conditions, BOOL)}
        points = [name for name, type_ in types.items() if type_ == _POINT]
        memberships = {f"{point}{_IN}{region}": BOOL for point in points for region in self._regions}
        variables = {
            name: t.Variable(self._conditions.get(name, name), type_, t.VariableRole.STATE)
            for name, type_ in {**types, **memberships}.items()
        }
        names = _DottedNames(types, self._regions, aliases)
        term = elaborate_expression(expression, Scope(variables), self._diagnostics, expected, names.rewrite)
        if term is None:
            return None
        return SceneCondition(term, expression.value, expression.span, is_number=expected != BOOL)

    def truth(
        self, expression: ExpressionField, aliases: Mapping[str, str] = _NO_ALIASES
    ) -> SceneCondition | None:
        """Elaborate the truth of a state variable: a condition, or a number.

        Args:
            expression: the field.
            aliases: names that stand for things of the scene, with the names of these.

        Returns:
            The truth; None after reporting its fault as a condition.
        """
        diagnostics, self._diagnostics = self._diagnostics, Diagnostics()
        number = self.condition(expression, aliases, RealType(NUMBER))
        self._diagnostics = diagnostics
        return self.condition(expression, aliases) if number is None else number


def _names_in(node: s.Node) -> Iterator[str]:
    if isinstance(node, s.Name):
        yield node.text
    for field in fields(node):
        value = getattr(node, field.name)
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, s.Node):
                yield from _names_in(part)


def region_names(scene: Scene) -> tuple[str, ...]:
    """List the regions of a scene.

    Args:
        scene: the scene.

    Returns:
        Names of its regions, and of its basins, each of which is the region inside it.
    """
    return (
        *scene.regions,
        *(name for name, body in scene.bodies.items() if isinstance(body.shape, Basin)),
    )


def _types(scene: Scene) -> Iterator[tuple[str, Type]]:
    yield "robot.base", _POINT
    yield "robot.tool", _POINT
    for name in scene.places:
        yield name, _POINT
    for name, body in scene.bodies.items():
        yield f"{name}.position", _POINT
        yield f"{name}.yaw", _ROTATION
        yield f"{name}.tilt", _ROTATION
        yield f"{name}.held", BOOL
        if isinstance(body.shape, UrdfModel):
            yield from ((f"{name}.{link}.position", _POINT) for link in body.shape.links)
            yield from (
                (f"{name}.{joint}", RealType(LENGTH) if kind == "prismatic" else _ROTATION)
                for joint, kind in body.shape.joints.items()
            )
    for name, instrument in scene.instruments.items():
        yield name, _instrument_type(instrument, scene.bodies)
    for name in scene.coatings:
        yield f"{name}.wiped", RealType(NUMBER)
        yield from ((f"{name}.{region}.wiped", RealType(NUMBER)) for region in region_names(scene))


def _instrument_type(instrument: Instrument, bodies: Mapping[str, SceneBody]) -> Type:
    match instrument:
        case ForceInstrument() | LoadInstrument():
            return RealType(FORCE)
        case PositionInstrument():
            return _POINT
        case JointInstrument(BodyPart(body, joint)):
            shape = bodies[body].shape
            is_prismatic = isinstance(shape, UrdfModel) and shape.joints.get(joint or "") == "prismatic"
            return RealType(LENGTH) if is_prismatic else _ROTATION


class _DottedNames:
    """Turns `can.position` and `can.position in pot` into single names."""

    def __init__(
        self, types: Mapping[str, Type], regions: Collection[str], aliases: Mapping[str, str]
    ) -> None:
        self._types, self._aliases = types, aliases
        self._regions = regions
        self._prefixes = {name[:dot] for name in types for dot in range(len(name)) if name[dot] == "."}

    def rewrite(self, node: s.Node) -> s.Node:
        """Rewrite an expression.

        Raises:
            ExpressionTypeError: a region is unknown.
        """
        if isinstance(node, s.Name) and node.text in self._aliases:
            return s.Name(self._aliases[node.text], node.extent)
        values: dict[str, Any] = {}
        for field in fields(node):
            value = getattr(node, field.name)
            if isinstance(value, s.Node):
                values[field.name] = self.rewrite(value)
            elif isinstance(value, tuple) and value and isinstance(value[0], s.Node):
                values[field.name] = tuple(self.rewrite(item) for item in value)
        return self._joined(replace(node, **values) if values else node)

    def _joined(self, node: s.Node) -> s.Node:
        match node:
            case s.Attribute(base=s.Name(text=base), name=s.Name(text=name), extent=extent):
                joined = f"{base}.{name}"
                if joined in self._types or joined in self._prefixes:
                    return s.Name(joined, extent)
                if base in self._prefixes and base not in self._types:
                    raise ExpressionTypeError(
                        "AE202",
                        f"`{base}` has no `{name}`",
                        node.name.extent,
                        cure=suggest_names(joined, self._types),
                    )
            case s.Membership(operand=operand, container=s.Name() as region, extent=extent):
                inside = s.Name(f"{self._point(operand)}{_IN}{self._region(region)}", extent)
                return s.Unary("not", inside, extent) if node.negated else inside
        return node

    def _point(self, operand: s.Node) -> str:
        """Return the variable before `in`; only one that a simulator can locate may stand there.

        Raises:
            ExpressionTypeError: it is none.
        """
        if isinstance(operand, s.Name) and self._types.get(operand.text) == _POINT:
            return operand.text
        points = [name for name, type_ in self._types.items() if type_ == _POINT]
        raise ExpressionTypeError(
            "AE202",
            "this is no position of this scene",
            operand.extent,
            cure="a place, or a body's or link's position: "
            + ", ".join(f"`{point}`" for point in points[:8]),
        )

    def _region(self, name: s.Name) -> str:
        """Return the region after `in`.

        Raises:
            ExpressionTypeError: it is none.
        """
        if name.text not in self._regions:
            cure = suggest_names(name.text, self._regions) or "declare it under `regions`"
            raise ExpressionTypeError(
                "AE202", f"`{name.text}` is no region of this scene", name.extent, cure=cure
            )
        return name.text


def resolve_part(
    reference: TextField, bodies: Mapping[str, SceneBody], what: str, diagnostics: Diagnostics
) -> BodyPart | None:
    """Resolve a reference to a body, link or joint.

    Args:
        reference: the field.
        bodies: bodies by name.
        what: `link`, which admits a whole body too, or `joint`.
        diagnostics: receives the faults.

    Returns:
        The body with the part; None after reporting the fault.
    """
    name, _, part = reference.value.partition(".")
    body = bodies.get(name)
    names: Collection[str] = ()
    if body is not None and isinstance(body.shape, UrdfModel):
        names = body.shape.joints if what == "joint" else body.shape.links if what == "link" else ()
    if body is not None and (part in names or (not part and what != "joint")):
        return BodyPart(name, part or None)
    known = list(bodies) if body is None else [f"{name}.{one}" for one in names]
    cure = suggest_names(reference.value, known)
    listed = ", ".join(f"`{one}`" for one in known)
    diagnostics.error(
        "AE122",
        f"`{reference.value}` is no {what} of this scene",
        reference.span,
        help=(cure or (f"write one of {listed}" if listed else f"`{name}` has none"),),
    )
    return None
