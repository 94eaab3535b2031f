"""Elaboration of the limits of contact: the speed at which the robot may touch a person.

A contact with a region of the body is transient for its first 0.5 s. Its greatest force is F = v·√(μ·k), of
the relative speed v, the region's stiffness k and the reduced mass μ = (1/m_H + 1/m_R)⁻¹ (ISO/TS 15066,
A.3.5). A region that is held fast has μ = m_R, which is the worst case and the one that is checked.
"""

from __future__ import annotations

from fractions import Fraction
from math import isqrt
from typing import NamedTuple

from aeros.spec.declared import motion as declared
from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import FORCE, LENGTH, MASS, TIME, Dimension
from aeros.spec.model.motion import ContactLimits, DrivingContact
from aeros.spec.text.fields import TextField

_SPEED = LENGTH * TIME**-1
_STIFFNESS = FORCE * LENGTH**-1


def elaborate_contact(
    contact: declared.ContactLimits, drives: bool, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> ContactLimits | None:
    """Elaborate the limits of contact, and check the speed against the transient force of every region.

    Args:
        contact: the declared section.
        drives: the site has a base that drives, which needs a limit of its own.
        vocabulary: vocabulary of the site, without faults.
        diagnostics: receives the faults.

    Returns:
        The limits in SI units, or None after reporting every fault.
    """
    return _ContactElaborator(vocabulary, diagnostics).contact(contact, drives)


def transient_speed(force: Fraction, stiffness: Fraction, mass: Fraction) -> Fraction:
    """Compute v = F_T/√(m·k), rounded down to whole µm/s.

    Args:
        force: transient limit of the region F_T, N.
        stiffness: of the region k, N/m; positive.
        mass: effective mass of the robot m, kg; positive.

    Returns:
        The speed, m/s.
    """
    return Fraction(isqrt(int(force * force / (mass * stiffness) * 10**12)), 10**6)


class _Base(NamedTuple):
    """A base that drives: its declaration, its speed, m/s, and the mass that drives, kg."""

    declaration: declared.DrivingContact
    speed: Fraction
    mass: Fraction


class _ContactElaborator:
    def __init__(self, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> None:
        self._vocabulary = vocabulary
        self._diagnostics = diagnostics

    def contact(self, contact: declared.ContactLimits, drives: bool) -> ContactLimits | None:
        before = len(self._diagnostics)
        if drives and contact.base is None:
            self._diagnostics.error(
                "AE612",
                "nothing limits the speed at which the base that drives may touch a person",
                contact.span,
                help=("add `base` to `motion.contact`, with the mass of the base and all that it carries",),
            )
        self._state(contact.distance, LENGTH)
        self._state(contact.measured_by, _SPEED)
        within = self._scalar(contact.within, LENGTH)
        speed = self._scalar(contact.speed, _SPEED)
        mass = self._scalar(contact.mass, MASS)
        force, stiffness = (
            self._table(contact.transient_force, FORCE),
            self._table(contact.stiffness, _STIFFNESS),
        )
        base = None if contact.base is None else self._base(contact.base)
        if len(self._diagnostics) > before:
            return None
        # Nothing is None here: each None above was reported.
        assert within is not None  # noqa: S101  for the type checker
        assert speed is not None  # noqa: S101
        assert mass is not None  # noqa: S101
        assert force is not None  # noqa: S101
        assert stiffness is not None  # noqa: S101
        if force.type.index != stiffness.type.index:
            self._diagnostics.error(
                "AE203",
                f"`{contact.transient_force.value}` and `{contact.stiffness.value}` are of different sets",
                contact.stiffness.span,
            )
            return None
        masses = [mass] if base is None else [mass, base.mass]
        if min(masses) <= 0 or min(stiffness.values) <= 0 or min(force.values) <= 0:
            self._diagnostics.error(
                "AE112", "mass, stiffness and force of a contact are positive", contact.span
            )
            return None
        self._check_speed(contact, contact.speed, speed, mass, force, stiffness)
        limit = None
        if base is not None:
            self._check_speed(contact, base.declaration.speed, base.speed, base.mass, force, stiffness)
            limit = DrivingContact(base.declaration.measured_by.value, base.speed)
        return ContactLimits(contact.distance.value, within, contact.measured_by.value, speed, limit)

    def _base(self, base: declared.DrivingContact) -> _Base | None:
        self._state(base.measured_by, _SPEED)
        speed, mass = self._scalar(base.speed, _SPEED), self._scalar(base.mass, MASS)
        return None if speed is None or mass is None else _Base(base, speed, mass)

    def _check_speed(
        self,
        contact: declared.ContactLimits,
        name: TextField,
        speed: Fraction,
        mass: Fraction,
        force: t.ConstantTable,
        stiffness: t.ConstantTable,
    ) -> None:
        """Report a speed that the transient limit of some region does not permit."""
        permitted = {
            region: transient_speed(limit, stiff, mass)
            for region, limit, stiff in zip(
                force.type.index.members, force.values, stiffness.values, strict=True
            )
        }
        worst = min(permitted, key=permitted.__getitem__)
        if speed > permitted[worst]:
            self._diagnostics.error(
                "AE612",
                f"`{name.value}` is {float(1000 * speed):.4g} mm/s; the transient force of `{worst}`"
                f" permits {float(1000 * permitted[worst]):.4g} mm/s",
                name.span,
                secondary=(SpanLabel(contact.transient_force.span, "v = F/√(m·k), of a region held fast"),),
                help=(f"reduce `{name.value}`",),
            )

    def _state(self, name: TextField, dimension: Dimension) -> None:
        found = resolve_name(name, self._vocabulary.state, "a state variable", self._diagnostics)
        if found is not None and found.variable.type != RealType(dimension):
            self._diagnostics.error(
                "AE203", f"`{name.value}` is {found.variable.type}, not in {dimension}", name.span
            )

    def _scalar(self, name: TextField, dimension: Dimension) -> Fraction | None:
        found = resolve_name(name, self._vocabulary.constants, "a constant", self._diagnostics)
        if found is None:
            return None
        if not isinstance(found, t.Literal) or not isinstance(found.value, Fraction):
            self._diagnostics.error("AE203", f"`{name.value}` is not a single value", name.span)
            return None
        if found.type != RealType(dimension):
            self._diagnostics.error("AE204", f"`{name.value}` is in {found.type}, not {dimension}", name.span)
        return found.value

    def _table(self, name: TextField, dimension: Dimension) -> t.ConstantTable | None:
        found = resolve_name(name, self._vocabulary.constants, "a constant", self._diagnostics)
        if found is None:
            return None
        if not isinstance(found, t.ConstantTable):
            self._diagnostics.error(
                "AE203", f"`{name.value}` does not have one value for each region", name.span
            )
            return None
        if found.type.element != RealType(dimension):
            self._diagnostics.error(
                "AE204", f"`{name.value}` is in {found.type.element}, not {dimension}", name.span
            )
        return found
