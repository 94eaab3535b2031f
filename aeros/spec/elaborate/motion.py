"""Elaboration of a site's motion section to the policy that trajectories are checked against.

Names and units are settled here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from aeros.spec.declared import motion as declared
from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel
from aeros.spec.diagnostics.grammar import an
from aeros.spec.elaborate.contact import elaborate_contact
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.obstacles import elaborate_obstacles
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import ANGLE, JOINT, LENGTH, TIME, Dimension
from aeros.spec.model.motion import (
    Barrier,
    HeldObject,
    LateTicks,
    MotionKind,
    MotionPolicy,
    ToolLimits,
    TouchedSurface,
    Tracking,
)
from aeros.spec.model.rules import ActionKind, Rule
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import TextField


def elaborate_motion(
    motion: declared.MotionPolicy, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> MotionPolicy | None:
    """Elaborate the motion section of a site.

    Args:
        motion: the declared section.
        vocabulary: vocabulary of the site, without faults.
        diagnostics: receives the faults.

    Returns:
        The policy with all numbers in SI units, or None after reporting every fault.
    """
    return _MotionElaborator(vocabulary, diagnostics).motion(motion)


def elaborate_late_ticks(
    declaration: declared.LateTicks | None, diagnostics: Diagnostics
) -> LateTicks | None:
    """Elaborate the limits of late ticks.

    Args:
        declaration: the declared section, if there is one.
        diagnostics: receives the faults.

    Returns:
        The limits in SI units; None if there are none, or after reporting every fault.
    """
    if declaration is None:
        return None
    period = elaborate_quantity(declaration.period, TIME, diagnostics)
    longest = elaborate_quantity(declaration.longest, TIME, diagnostics)
    if period is None or longest is None:
        return None
    if not 0 < period <= longest:
        diagnostics.error(
            "AE112", "`period` is above 0 and not longer than `longest`", declaration.period.span
        )
        return None
    return LateTicks(period, declaration.in_a_row.value, longest)


def check_tracking_rules(
    declaration: declared.MotionPolicy,
    motion: MotionPolicy | None,
    rules: Sequence[Rule],
    diagnostics: Diagnostics,
) -> None:
    """Check that a rule on every kind that moves keeps the measured tracking error within its bound.

    A rule keeps the bound if it requires `variable <= number`, alone or together with other conditions, and
    the number is at most the bound.

    Args:
        declaration: the declared motion section.
        motion: the elaborated section; None after faults.
        rules: rules of the site.
        diagnostics: receives the faults.
    """
    if motion is None or motion.tracking is None:
        return
    variable, bound = motion.tracking.variable, motion.tracking.bound
    within = declaration.tracking.within
    unbounded: dict[Fraction | None, list[TextField]] = {}
    for name, _ in declaration.on:
        terms = [rule.terms[name.value] for rule in rules if name.value in rule.terms]
        least = min([number for term in terms for number in _upper_bounds(term, variable)], default=None)
        if least is None or least > bound:
            unbounded.setdefault(least, []).append(name)
    for least, names in unbounded.items():
        kinds = ", ".join([f"`{name.value}`" for name in names])
        if least is None:
            headline = f"no rule on {kinds} requires `{variable} <= {within.value}`"
        else:
            headline = (
                f"the rules on {kinds} allow {an(variable)} of {float(1000 * least):.3g} mm; "
                f"motions are decided for {within.value}"
            )
        diagnostics.error(
            "AE611",
            headline,
            names[0].span,
            secondary=(SpanLabel(within.span, "the bound that motions are decided for"),),
            help=(f"require `{variable} <= {within.value}` of {kinds}, without a condition",),
        )


def _upper_bounds(term: t.Term, variable: str) -> Iterator[Fraction]:
    """Yield the numbers that a variable must not exceed wherever `term` is true."""
    match term:
        case t.And(operands=operands):
            for operand in operands:
                yield from _upper_bounds(operand, variable)
        case t.Compare(
            op="<" | "<=", left=t.Variable(name=name), right=t.Literal(value=Fraction() as number)
        ):
            if name == variable:
                yield number


class _MotionElaborator:
    def __init__(self, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> None:
        self._vocabulary = vocabulary
        self._diagnostics = diagnostics

    def motion(self, motion: declared.MotionPolicy) -> MotionPolicy | None:
        before = len(self._diagnostics)
        measured = resolve_name(
            motion.starts_at, self._vocabulary.state, "a state variable", self._diagnostics
        )
        index, position = None, ANGLE
        if measured is not None:
            index, position = self._joints(motion.starts_at, measured.variable)
        kinds = {name.value: self._kind(name, kind, measured) for name, kind in motion.on}
        joints, tool = motion.joints, motion.tool
        tables = [
            self._joint_table(name, _derivative_dimension(position, order), index)
            for name, order in (
                (joints.lowest, 0),
                (joints.highest, 0),
                (joints.speed, 1),
                (joints.acceleration, 2),
                (joints.jerk, 3),
            )
        ]
        moving = (tool.speed, tool.acceleration, tool.jerk)
        turning = (tool.turning_speed, tool.turning_acceleration, tool.turning_jerk)
        singles = [
            self._scalar_constant(name, _derivative_dimension(LENGTH, order))
            for order, name in enumerate(moving, 1)
        ]
        singles += [
            self._scalar_constant(name, _derivative_dimension(ANGLE, order))
            for order, name in enumerate(turning, 1)
        ]
        driving = () if motion.base is None else (motion.base.speed, motion.base.acceleration)
        singles += [
            self._scalar_constant(name, _derivative_dimension(LENGTH, order))
            for order, name in enumerate(driving, 1)
        ]
        lengths = [
            elaborate_quantity(text, dimension, self._diagnostics)
            for text, dimension in (
                (motion.starts_within, position),
                (motion.ends_within, LENGTH),
                (motion.clearance, LENGTH),
                (motion.link_clearance, LENGTH),
            )
        ]
        held = _elaborate_held(motion.held, self._vocabulary, self._diagnostics)
        base = None if motion.base is None else motion.base.measured_by
        if base is not None:
            _require_position(base, self._vocabulary, self._diagnostics)
        if motion.back_off is not None:
            self._back_off(motion.back_off)
        touch = motion.contact
        late_ticks = elaborate_late_ticks(motion.late_ticks, self._diagnostics)
        obstacles = elaborate_obstacles(motion.obstacles, self._vocabulary, self._diagnostics)
        contact = None
        if touch is not None:
            drives = motion.base is not None
            contact = elaborate_contact(touch, drives, self._vocabulary, self._diagnostics)
        barriers = [
            _elaborate_barrier(barrier, self._vocabulary, self._diagnostics) for barrier in motion.barriers
        ]
        if len(self._diagnostics) > before:
            return None
        # Nothing is None here: each None above was reported.
        lowest, highest, *rates = (table for table in tables if table is not None)
        numbers = [single for single in singles if single is not None]
        start, end, clearance, link_clearance = (length for length in lengths if length is not None)
        lever = LENGTH if position == ANGLE else LENGTH * position**-1
        tracking = self._tracking(motion, (index, lever), start, min(clearance, link_clearance))
        return MotionPolicy(
            kinds=kinds,
            start_variable=motion.starts_at.value,
            start_tolerance=start,
            end_tolerance=end,
            lowest=lowest,
            highest=highest,
            joint_limits=(rates[0], rates[1], rates[2]),
            tool_limits=ToolLimits(
                (numbers[0], numbers[1], numbers[2]), (numbers[3], numbers[4], numbers[5])
            ),
            clearance=clearance,
            barriers=tuple(barrier for barrier in barriers if barrier is not None),
            base_limits=(numbers[6], numbers[7]) if driving else None,
            base_variable=None if base is None else base.value,
            link_clearance=link_clearance,
            held=held,
            tracking=tracking,
            contact=contact,
            late_ticks=late_ticks,
            obstacles=obstacles,
            back_off=None if motion.back_off is None else motion.back_off.value,
            is_mixed=position == JOINT,
        )

    def _tracking(
        self,
        motion: declared.MotionPolicy,
        joints: tuple[str | None, Dimension],
        start: Fraction,
        clearance: Fraction,
    ) -> Tracking | None:
        """Elaborate the bound on tracking, and check it and the start tolerance against the clearances.

        Args:
            motion: the declared section.
            joints: the index set of the joints, and the dimension of their levers.
            start: greatest distance of a motion's start from the measured joints.
            clearance: the least of the site's clearances, m.

        Returns:
            The bound in SI; None after reporting a fault.
        """
        declaration = motion.tracking
        measured = resolve_name(
            declaration.measured_by, self._vocabulary.state, "a state variable", self._diagnostics
        )
        within = elaborate_quantity(declaration.within, LENGTH, self._diagnostics)
        index, lever = joints
        levers = self._joint_table(declaration.levers, lever, index)
        if measured is not None and measured.variable.type != RealType(LENGTH):
            self._diagnostics.error(
                "AE203",
                f"`{declaration.measured_by.value}` is {measured.variable.type}, not a length",
                declaration.measured_by.span,
            )
            return None
        if measured is None or within is None or levers is None:
            return None
        if within > clearance:
            _report_beyond_clearance(
                self._diagnostics,
                motion,
                declaration.within,
                f"links may be {declaration.within.value} from their commands",
                "tracking.within",
            )
        offset = start * sum(levers)
        if offset > clearance:
            _report_beyond_clearance(
                self._diagnostics,
                motion,
                motion.starts_within,
                f"joints that start {motion.starts_within.value} off put a link {float(1000 * offset):.3g} mm"
                " off",
                "starts_within",
            )
        return Tracking(declaration.measured_by.value, within, levers)

    def _back_off(self, name: TextField) -> None:
        """Check that the kind exists and has no parameters: nobody asks for it, so nobody gives any."""
        kind = resolve_name(name, self._vocabulary.kinds, "an action kind", self._diagnostics)
        if kind is not None and (kind.parameters or kind.protective):
            self._diagnostics.error(
                "AE112", f"`{name.value}` backs off, so it has no parameters and is not protective", name.span
            )

    def _kind(self, name: TextField, motion: declared.MotionKind, measured: Declared | None) -> MotionKind:
        kind = resolve_name(name, self._vocabulary.kinds, "an action kind", self._diagnostics)
        parameters = {} if kind is None else kind.parameters
        base = motion.base_ends_at
        if base is not None and len(base) != 2:
            self._diagnostics.error("AE112", "`base_ends_at` takes two parameters, x and y", motion.span)
        ends = motion.joints_end_at
        count = _joint_count(measured)
        if ends is not None and count is not None and len(ends) != count:
            headline = f"`joints_end_at` takes {count} parameters, one for each joint, not {len(ends)}"
            self._diagnostics.error("AE112", headline, motion.span)
        if kind is None:
            return MotionKind(None, None, None)
        self._parameter(motion.tool_ends_at, parameters, kind, VectorType(LENGTH))
        self._parameter(motion.peak_speed, parameters, kind, RealType(_derivative_dimension(LENGTH, 1)))
        for coordinate in base or ():
            self._parameter(coordinate, parameters, kind, RealType(LENGTH))
        position = RealType(_position_dimension(measured))
        for joint in ends or ():
            self._parameter(joint, parameters, kind, position)
        return MotionKind(
            None if motion.tool_ends_at is None else motion.tool_ends_at.value,
            None if base is None or len(base) != 2 else (base[0].value, base[1].value),
            None if motion.peak_speed is None else motion.peak_speed.value,
            None if ends is None or len(ends) != count else tuple(one.value for one in ends),
            None if motion.held_touches is None else self._surface(motion.held_touches),
        )

    def _surface(self, contact: declared.HeldContact) -> TouchedSurface | None:
        for name in contact.volumes:
            resolve_name(name, self._vocabulary.volumes, "a volume", self._diagnostics)
        speed = self._scalar_constant(contact.speed, _derivative_dimension(LENGTH, 1))
        within = contact.within
        distance = None if within is None else elaborate_quantity(within, LENGTH, self._diagnostics)
        names = frozenset(name.value for name in contact.volumes)
        return None if speed is None else TouchedSurface(names, speed, distance)

    def _parameter(
        self, name: TextField | None, parameters: Mapping[str, Declared], kind: ActionKind, type_: Type
    ) -> None:
        if name is None:
            return
        found = resolve_name(name, parameters, f"a parameter of `{kind.name}`", self._diagnostics)
        if found is not None and found.variable.type != type_:
            self._diagnostics.error(
                "AE203", f"`{name.value}` is {found.variable.type}, not {type_}", name.span
            )

    def _joints(self, name: TextField, variable: t.Variable) -> tuple[str | None, Dimension]:
        """Return the index set and the dimension of the joints' positions, rad or jpos."""
        type_ = variable.type
        for position in (ANGLE, JOINT):
            if isinstance(type_, FamilyType) and type_.element == RealType(position):
                return type_.index.name, position
        self._diagnostics.error(
            "AE203",
            f"`{name.value}` does not have one position, in rad or jpos, for each joint",
            name.span,
            help=("use `unit: jpos` for an arm with a prismatic joint: rad of a revolute joint, m of it",),
        )
        return None, ANGLE

    def _joint_table(
        self, name: TextField, dimension: Dimension, index: str | None
    ) -> tuple[Fraction, ...] | None:
        found = resolve_name(name, self._vocabulary.constants, "a constant", self._diagnostics)
        if found is None:
            return None
        if not isinstance(found, t.ConstantTable) or (index is not None and found.type.index.name != index):
            self._diagnostics.error(
                "AE203", f"`{name.value}` does not have one value for each joint", name.span
            )
            return None
        if found.type.element != RealType(dimension):
            self._diagnostics.error(
                "AE204", f"`{name.value}` is in {found.type.element}, not {dimension}", name.span
            )
        return found.values

    def _scalar_constant(self, name: TextField, dimension: Dimension) -> Fraction | None:
        found = resolve_name(name, self._vocabulary.constants, "a constant", self._diagnostics)
        if found is None:
            return None
        if not isinstance(found, t.Literal) or not isinstance(found.value, Fraction):
            self._diagnostics.error("AE203", f"`{name.value}` is not a single value", name.span)
            return None
        if found.type != RealType(dimension):
            self._diagnostics.error("AE204", f"`{name.value}` is in {found.type}, not {dimension}", name.span)
        return found.value


def _require_position(name: TextField, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> None:
    """Report a name that is no state variable, or whose variable is no position."""
    measured = resolve_name(name, vocabulary.state, "a state variable", diagnostics)
    if measured is not None and measured.variable.type != VectorType(LENGTH):
        diagnostics.error("AE203", f"`{name.value}` is {measured.variable.type}, not a position", name.span)


def _derivative_dimension(dimension: Dimension, order: int) -> Dimension:
    """Return the dimension of a quantity's derivative of this order with respect to time."""
    return dimension * TIME**-order


def _position_dimension(measured: Declared | None) -> Dimension:
    """Return the dimension of the joints' positions: that which the state variable has, else an angle."""
    type_ = None if measured is None else measured.variable.type
    return JOINT if isinstance(type_, FamilyType) and type_.element == RealType(JOINT) else ANGLE


def _joint_count(measured: Declared | None) -> int | None:
    """Return the number of joints that the state variable measures; None if it is not a family."""
    type_ = None if measured is None else measured.variable.type
    return len(type_.index.members) if isinstance(type_, FamilyType) else None


def _report_beyond_clearance(
    diagnostics: Diagnostics, motion: declared.MotionPolicy, bound: TextField, headline: str, field: str
) -> None:
    diagnostics.error(
        "AE611",
        f"{headline}; the clearance is {motion.clearance.value}, of links {motion.link_clearance.value}",
        bound.span,
        secondary=(
            SpanLabel(motion.clearance.span, "whole motions keep this distance from barriers"),
            SpanLabel(motion.link_clearance.span, "links keep this distance from each other"),
        ),
        help=(f"enlarge the smaller clearance, or reduce `{field}`",),
    )


def _elaborate_held(
    held: declared.HeldObject, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> HeldObject | None:
    variable, volume = held.unless_false, held.volume
    if held.nothing is not None and variable is None and volume is None and not held.gripped_by:
        return None
    if held.nothing is not None or variable is None or volume is None:
        diagnostics.error(
            "AE112",
            "`held` takes `unless_false` and `volume`, or `nothing` alone",
            held.span,
            help=("name the space of the largest object, or say why this robot never holds anything",),
        )
        return None
    measured = resolve_name(variable, vocabulary.state, "a state variable", diagnostics)
    if measured is not None and measured.variable.type != BoolType():
        diagnostics.error("AE203", f"`{variable.value}` is {measured.variable.type}, not bool", variable.span)
    for name in held.gripped_by:
        resolve_name(name, vocabulary.kinds, "an action kind", diagnostics)
    box = resolve_name(volume, vocabulary.volumes, "a volume", diagnostics)
    kinds = frozenset(name.value for name in held.gripped_by)
    return None if box is None else HeldObject(variable.value, box, kinds)


def _elaborate_barrier(
    barrier: declared.Barrier, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> Barrier | None:
    box = resolve_name(barrier.volume, vocabulary.volumes, "a volume", diagnostics)
    if barrier.links == ():
        diagnostics.error("AE112", f"the barrier `{barrier.id.value}` applies to no link", barrier.id.span)
    if box is None:
        return None
    return Barrier(
        id=barrier.id.value,
        volume=barrier.volume.value,
        box=box,
        keep_inside=barrier.keep.value == "in",
        is_in_base_frame=barrier.frame is not None and barrier.frame.value == "base",
        links=None if barrier.links is None else frozenset(link.value for link in barrier.links),
        rationale=barrier.rationale.value,
    )
