"""The types of the expression language: closed, dimensioned, compared by value."""

from __future__ import annotations

from dataclasses import dataclass

from aeros.spec.expr.units import NUMBER, Dimension


@dataclass(frozen=True, slots=True)
class BoolType:
    """True or false."""

    def __str__(self) -> str:
        """As shown in diagnostics."""
        return "bool"


@dataclass(frozen=True, slots=True)
class RealType:
    """An exact real number.

    Attributes:
        dimension: its SI dimension.
    """

    dimension: Dimension

    def __str__(self) -> str:
        """As shown in diagnostics: its SI unit."""
        return f"real [{self.dimension}]"


@dataclass(frozen=True, slots=True)
class IntegerType(RealType):
    """Type of whole numbers. Variables are declared with it; expressions read it as a dimensionless real.

    Attributes:
        dimension: the dimensionless one.
    """

    dimension: Dimension = NUMBER

    def __str__(self) -> str:
        """As shown in diagnostics."""
        return "int"


@dataclass(frozen=True, slots=True)
class VectorType:
    """Three reals x, y, z of one dimension, in the world frame W.

    Attributes:
        dimension: SI dimension of each component.
    """

    dimension: Dimension

    def __str__(self) -> str:
        """As shown in diagnostics: the SI unit of its components."""
        return f"vec3 [{self.dimension}]"


@dataclass(frozen=True, slots=True)
class EnumType:
    """A closed, ordered set; also the index set of families.

    Attributes:
        name: name of the enumeration.
        members: names of its members, in order.
    """

    name: str
    members: tuple[str, ...]

    def __str__(self) -> str:
        """As shown in diagnostics."""
        return self.name


@dataclass(frozen=True, slots=True)
class FamilyType:
    """Type of families: one value for each member of an index set.

    Attributes:
        index: the index set.
        element: type of each value.
    """

    index: EnumType
    element: BoolType | RealType

    def __str__(self) -> str:
        """As shown in diagnostics."""
        return f"{self.element} for each of {self.index}"


ScalarType = BoolType | RealType | EnumType
Type = ScalarType | VectorType | FamilyType

BOOL = BoolType()
