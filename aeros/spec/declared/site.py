"""Schema of a site file and of overlays on it, unresolved and closed.

Names and units are still text; `elaborate.site` gives them meaning.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal, TypeVar

from aeros.spec.declared.configuration import ModuleSettings
from aeros.spec.declared.field_types import Identifier, Named, RiskWord, Slug
from aeros.spec.declared.motion import MotionPolicy
from aeros.spec.declared.objects import ObjectKind
from aeros.spec.declared.perception import Camera
from aeros.spec.declared.policy import Access, OperatorOverride, Policy
from aeros.spec.declared.quantity import Quantity
from aeros.spec.declared.sensor_errors import AreaScanners, SensorErrors
from aeros.spec.declared.tools import Tool
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    TextField,
    ValueBounds,
)

_T = TypeVar("_T")


@dataclass(frozen=True)
class StateVariable(Quantity):
    """One measured quantity of the vocabulary."""

    index: Identifier | None = field(
        default=None, metadata={"doc": "one value for each member of this enum, as in `index: joints`"}
    )
    sensor: Identifier = field(
        kw_only=True, metadata={"doc": "the sensor that measures it, as in `sensor: area_scanner`"}
    )
    max_age: TextField = field(
        kw_only=True, metadata={"doc": "older values are unknown, as in `max_age: 100 ms`"}
    )
    offers: tuple[Identifier, ...] = field(
        default=(),
        metadata={"doc": "uses that modules may make of it, as in `offers: [surface]`"},
    )


@dataclass(frozen=True)
class Constant:
    """A named constant, or one for each member of an enum.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    value: ExpressionField | None = field(default=None, metadata={"doc": "the value, as in `value: 500 mm`"})
    unit: TextField | None = field(default=None, metadata={"doc": "the unit of `values`, as in `unit: rad`"})
    index: Identifier | None = field(default=None, metadata={"doc": "the enum that indexes `values`"})
    values: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "one value for each member, in order"}
    )
    source: TextField | None = field(default=None, metadata={"doc": "the source of the number"})
    offers: tuple[Identifier, ...] = field(
        default=(),
        metadata={"doc": "uses that modules may make of it, as in `offers: [surface]`"},
    )


@dataclass(frozen=True)
class Volume:
    """An axis-aligned box in the world frame W.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    lower: tuple[TextField, ...] = field(
        metadata={"doc": "lower corner, as in `lower: [0.1 m, -0.6 m, 0 m]`"}
    )
    upper: tuple[TextField, ...] = field(
        metadata={"doc": "upper corner, as in `upper: [0.8 m, 0.6 m, 0.9 m]`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})
    offers: tuple[Identifier, ...] = field(
        default=(),
        metadata={"doc": "uses that modules may make of it, as in `offers: [surface]`"},
    )


@dataclass(frozen=True)
class ActionKind:
    """One kind of action that a skill may ask for.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "the plant's reaction, for people"})
    risk: RiskWord = field(metadata={"doc": "the least risk that a skill must declare to ask for it"})
    actuators: tuple[Identifier, ...] = field(
        default=(), metadata={"doc": "the actuators that it moves, as in `actuators: [arm]`"}
    )
    protective: BooleanField | None = field(
        default=None, metadata={"doc": "`true` for the protective stop, which every state must allow"}
    )
    parameters: Named[Quantity] = field(default=MappingField(), metadata={"doc": "typed parameters"})
    means: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the action of AEROS's simulators that it is, if the site has another word for it, as in "
            "`means: move_tool`"
        },
    )
    tool: Tool | None = field(
        default=None,
        metadata={
            "doc": "the service that carries it out, if it is not the robot, as in "
            "`tool: {http: http://127.0.0.1:8080/time, timeout: 2 s, answers: [cooking_time]}`"
        },
    )


@dataclass(frozen=True)
class Invariant:
    """A rule of the site (Φ): a condition that must hold for every state and action.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: workspace`"})
    require: ExpressionField = field(metadata={"doc": "the condition, as in `require: speed <= 250 mm/s`"})
    rationale: TextField = field(metadata={"doc": "the reason for the rule"})
    source: TextField = field(metadata={"doc": "its source: a standard, data sheet or assessment"})
    on: tuple[Identifier, ...] | None = field(
        default=None, metadata={"doc": "the action kinds it governs; all but the protective stop if absent"}
    )
    attenuate: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={
            "doc": "the reduced value of a violating parameter, as in `speed: min(speed, 0.25 m/s)`; of a "
            "vector, other than a place, the length to which it is shortened, in its direction"
        },
    )


@dataclass(frozen=True)
class JointInvariant:
    """A rule about two actions that are executed at the same time.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    id: Slug = field(metadata={"doc": "a short name, as in `id: combined-speed`"})
    on: Named[Identifier] = field(
        metadata={"doc": "two roles, each of an action kind, as in `on: {a: move_tool, b: move_base}`"}
    )
    require: ExpressionField = field(
        metadata={"doc": "the condition, as in `require: a.speed + b.speed <= 500 mm/s`"}
    )
    rationale: TextField = field(metadata={"doc": "the reason for the rule"})
    source: TextField = field(metadata={"doc": "its source: a standard, data sheet or assessment"})


@dataclass(frozen=True)
class ModuleSensor:
    """Sensor whose quantities modules declare.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "its quantities, for people"})
    offers: tuple[Identifier, ...] = field(
        default=(),
        metadata={"doc": "uses that modules may make of it, as in `offers: [fixture_survey]`"},
    )


@dataclass(frozen=True)
class Site:
    """A whole site file.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/site/1"] = field(metadata={"doc": "`schema: aeros/site/1`"})
    id: Identifier = field(metadata={"doc": "the site's name, as in `id: panda_cell`"})
    description: TextField = field(metadata={"doc": "the site's purpose, for people"})
    state: Named[StateVariable] = field(metadata={"doc": "the measured state variables"})
    actions: Named[ActionKind] = field(metadata={"doc": "the action kinds"})
    invariants: tuple[Invariant, ...] = field(metadata={"doc": "the invariants Φ"})
    policy: Policy = field(metadata={"doc": "the policy Π"})
    robot: TextField | None = field(
        default=None,
        metadata={
            "doc": "the robot: a name, or a robot file relative to this file, as in `robot: my_arm.yaml`; "
            "that of the reference site if absent"
        },
    )
    standing_postures: Named[tuple[NumberField, ...]] = field(
        default=MappingField(),
        metadata={
            "doc": "positions of the joints of arms that stand, rad or m, by the prefix of each in the robot "
            "file, in place of its `posture`, as in `standing_postures: {left_: [0, 0, 0, -2.4, 0, 2.4, 0]}`"
        },
    )
    enums: Named[tuple[Identifier, ...]] = field(
        default=MappingField(), metadata={"doc": "closed enumerations"}
    )
    constants: Named[Constant] = field(default=MappingField(), metadata={"doc": "named constants"})
    volumes: Named[Volume] = field(default=MappingField(), metadata={"doc": "named boxes in W"})
    definitions: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={
            "doc": "conditions on the state that a name stands for, in invariants and in modules, as in "
            "`definitions: {person_is_near: human_distance < 1200 mm}`"
        },
    )
    joint: tuple[JointInvariant, ...] = field(
        default=(), metadata={"doc": "invariants about two actions at the same time"}
    )
    resources: Named[Annotated[IntegerField, ValueBounds(1, 1_000_000)]] = field(
        default=MappingField(),
        metadata={"doc": "resources that skills hold while they run, with their numbers"},
    )
    motion: MotionPolicy | None = field(
        default=None, metadata={"doc": "limits for whole motions; if absent, motions are not checked"}
    )
    sensors: Named[TextField | ModuleSensor] = field(
        default=MappingField(),
        metadata={
            "doc": "sensors whose quantities modules declare, with what each measures, as in "
            "`sensors: {load_cell: force on the press}`, or with what they offer"
        },
    )
    moved_by: Named[tuple[Identifier, ...]] = field(
        default=MappingField(),
        metadata={
            "doc": "by sensor: what it measures changes only while one of these actuators moves, as in "
            "`moved_by: {wheel_odometry: [base], cell_survey: []}`; what a sensor without an entry measures "
            "may change at any time"
        },
    )
    cameras: Named[Camera] = field(
        default=MappingField(),
        metadata={
            "doc": "the cameras whose pictures perceivers may get; each a member of enum `cameras`, as in "
            "`cameras: {overhead: {sensor: overhead_camera, width: 640, height: 480}}`"
        },
    )
    objects: Named[ObjectKind] = field(
        default=MappingField(),
        metadata={
            "doc": "kinds of objects that people may ask the robot for, members of the enum `objects`, as in "
            "`objects: {small_cup: {words: [cup, small cup], cylinder: [3 cm, 8 cm]}}`"
        },
    )
    sensor_errors: SensorErrors | None = field(
        default=None,
        metadata={"doc": "errors that simulated plants give the sensors; if absent, they are ideal"},
    )
    area_scanners: AreaScanners | None = field(
        default=None,
        metadata={
            "doc": "scanners that measure how far people are, in simulated plants; if absent, that is exact"
        },
    )
    modules: Named[ModuleSettings] = field(
        default=MappingField(),
        metadata={
            "doc": "bindings and parameters of modules at this site, as in "
            "`modules: {clean_pot: {bind: {surface: bench}, set: {force: 6 N}}}`"
        },
    )
    compute: Named[TextField] = field(
        default=MappingField(),
        metadata={
            "doc": "computing devices that modules may ask for, with the device file that a computer has, "
            "as in `compute: {gpu: /dev/nvidia0}`"
        },
    )


@dataclass(frozen=True)
class Overlay:
    """An operator's additions to a site: access, blocks, tools, words and settings; it cannot weaken Φ.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/overlay/1"] = field(metadata={"doc": "`schema: aeros/overlay/1`"})
    base: TextField | None = field(
        default=None,
        metadata={
            "doc": "the site file or overlay that it adds to, relative to this file, as in "
            "`base: cell.yaml`; the reference site if absent"
        },
    )
    description: TextField | None = field(default=None, metadata={"doc": "its purpose, for people"})
    grants: Named[Access] = field(
        default=MappingField(),
        metadata={
            "doc": "further access, by module, in addition to that of the site, as in "
            "`grants: {sort_bolts: {actuators: [base]}}`"
        },
    )
    blocks: tuple[OperatorOverride, ...] = field(default=(), metadata={"doc": "further operator overrides"})
    actions: Named[ActionKind] = field(
        default=MappingField(), metadata={"doc": "further action kinds, each of which has a `tool`"}
    )
    state: Named[StateVariable] = field(
        default=MappingField(), metadata={"doc": "the state variables that these tools answer"}
    )
    objects: Named[ObjectKind] = field(
        default=MappingField(),
        metadata={
            "doc": "further kinds of objects that people may ask the robot for, as in "
            "`objects: {small_cup: {words: [cup, small cup], cylinder: [3 cm, 8 cm]}}`"
        },
    )
    definitions: Named[ExpressionField] = field(
        default=MappingField(),
        metadata={
            "doc": "further conditions on the state that a name stands for, for modules, as in "
            "`definitions: {person_is_near: human_distance < 1200 mm}`"
        },
    )
    modules: Named[ModuleSettings] = field(
        default=MappingField(),
        metadata={
            "doc": "bindings and parameters of modules, which come before those of the site, as in "
            "`modules: {clean_pot: {set: {force: 6 N}}}`"
        },
    )


def with_overlay(site: Site, overlay: Overlay) -> Site:
    """Add an overlay to a site.

    Args:
        site: the site as declared.
        overlay: the overlay.

    Returns:
        The site with the access, blocks, tools, words and settings of both. A setting of the overlay replaces
        one of the same name. All else of the site is as it was.
    """
    policy = replace(
        site.policy,
        grants=_merged(site.policy.grants, overlay.grants, _joined_access),
        blocks=(*site.policy.blocks, *overlay.blocks),
    )
    return replace(
        site,
        policy=policy,
        actions=_merged(site.actions, overlay.actions, lambda below, _: below),
        state=_merged(site.state, overlay.state, lambda below, _: below),
        objects=_merged(site.objects, overlay.objects, lambda below, _: below),
        definitions=_merged(site.definitions, overlay.definitions, lambda below, _: below),
        modules=_merged(site.modules, overlay.modules, _joined_settings),
    )


def _merged(
    below: MappingField[_T], above: MappingField[_T], join: Callable[[_T, _T], _T]
) -> MappingField[_T]:
    """Merge two mappings; a name that both have is placed where the upper one has it."""
    old = {key.value: value for key, value in below}
    new = {
        key.value: (key, join(old[key.value], value) if key.value in old else value) for key, value in above
    }
    kept = (new.pop(key.value, (key, value)) for key, value in below)
    return MappingField((*kept, *new.values()), below.span or above.span)


def _joined_access(below: Access, above: Access) -> Access:
    return replace(
        above,
        actuators=_joined_names(below.actuators, above.actuators),
        sensors=_joined_names(below.sensors, above.sensors),
        channels=_joined_names(below.channels, above.channels),
        compute=_joined_names(below.compute, above.compute),
    )


def _joined_names(below: tuple[Identifier, ...], above: tuple[Identifier, ...]) -> tuple[Identifier, ...]:
    known = {one.value for one in above}
    return (*above, *(one for one in below if one.value not in known))


def _joined_settings(below: ModuleSettings, above: ModuleSettings) -> ModuleSettings:
    return replace(
        above,
        bind=_merged(below.bind, above.bind, lambda _, upper: upper),
        set=_merged(below.set, above.set, lambda _, upper: upper),
    )
