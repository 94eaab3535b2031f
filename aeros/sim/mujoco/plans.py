"""Descriptions of bodies before they are in a MuJoCo model: links, joints, shapes and masses.

Units: m, kg, rad, N·m. Frames: each link has its own; a shape's place is in the frame of its link.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi
from typing import Final, Literal, NamedTuple

import numpy as np

from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.sim.pictures.ray_caster import axes_of
from aeros.sim.pictures.solids import Array, Solid

AT_ORIGIN: Final = Pose((0.0, 0.0, 0.0), UPRIGHT)


class ShapePlan(NamedTuple):
    """A shape that other bodies touch.

    Attributes:
        kind: its kind.
        size: full lengths of a box; radius and height of a cylinder, then 0; radius of a sphere, then 0, 0;
            radius and length of the straight part of a capsule, then 0; 0 of a hull.
        place: pose of its middle in the frame of its link.
        corners: of a hull, in the frame of its link.
        margin: distance from the hull of the corners within which the link is.
    """

    kind: Literal["box", "cylinder", "sphere", "capsule", "hull"]
    size: Vector3
    place: Pose = AT_ORIGIN
    corners: tuple[Vector3, ...] = ()
    margin: float = 0.0

    @property
    def volume(self) -> float:
        """Volume, m³; 0 of a hull."""
        a, b, c = self.size
        match self.kind:
            case "box":
                return a * b * c
            case "cylinder":
                return pi * a * a * b
            case "sphere":
                return 4.0 / 3.0 * pi * a**3
            case "capsule":
                return pi * a * a * b + 4.0 / 3.0 * pi * a**3
            case "hull":
                return 0.0

    def inertia(self, mass: float) -> Array:
        """Compute the moments of inertia about its middle, along its own axes.

        Args:
            mass: kg.

        Returns:
            The diagonal of the matrix (3,), kg·m²; a capsule counts as a cylinder of its whole length.
        """
        a, b, c = self.size
        match self.kind:
            case "box":
                squares = np.array((b * b + c * c, a * a + c * c, a * a + b * b))
                return mass / 12.0 * squares
            case "sphere" | "hull":
                return np.full(3, 0.4 * mass * a * a)
            case "capsule" | "cylinder":
                height = b + (2.0 * a if self.kind == "capsule" else 0.0)
                across = mass * (3.0 * a * a + height * height) / 12.0
                return np.array((across, across, 0.5 * mass * a * a))


class JointPlan(NamedTuple):
    """A movable joint.

    Attributes:
        name: its name.
        slides: True if it is prismatic, else it turns.
        axis: in the frame of its link.
        limits: least and greatest position, rad or m; None if it has none.
        friction: dry friction, N·m or N.
        damping: N·m·s/rad or N·s/m.
        armature: inertia of its motor, kg·m² or kg.
    """

    name: str
    slides: bool
    axis: Vector3
    limits: tuple[float, float] | None = None
    friction: float = 0.0
    damping: float = 0.0
    armature: float = 0.0


class Friction(NamedTuple):
    """Friction of the surface of a link, as in scene files.

    Attributes:
        lateral: Coulomb coefficient.
        spinning: about the normal of a contact, m.
        rolling: lever of the braking torque as it rolls, m.
    """

    lateral: float
    spinning: float = 0.02
    rolling: float = 0.0


class Inertia(NamedTuple):
    """Mass of a link and its distribution.

    Attributes:
        mass: kg.
        centre: centre of mass in the frame of the link, m.
        matrix: moments about it along the axes of the link (3, 3), kg·m².
    """

    mass: float
    centre: Vector3
    matrix: Array


class LinkPlan(NamedTuple):
    """A link.

    Attributes:
        name: its name.
        parent: name of the link that it is joined to; None for the base of a body.
        place: its pose in the frame of the parent, at position 0 of the joint.
        joint: the joint; None if it is fixed to the parent.
        inertia: its mass; None if it has none, as a base that is fixed to W.
        shapes: what others touch.
        friction: of its surface.
        visuals: what cameras see, in its frame.
    """

    name: str
    parent: str | None
    place: Pose
    joint: JointPlan | None
    inertia: Inertia | None
    shapes: tuple[ShapePlan, ...]
    friction: Friction
    visuals: tuple[Solid, ...] = ()


def inertia_of_shapes(mass: float, shapes: Sequence[ShapePlan]) -> Inertia:
    """Distribute a mass evenly in shapes, with its centre at the origin of their frame.

    Args:
        mass: kg.
        shapes: the shapes.

    Returns:
        The mass, and the moments about the origin.
    """
    volume = sum(shape.volume for shape in shapes)
    matrix = np.zeros((3, 3))
    for shape in shapes:
        part = mass * shape.volume / volume
        axes, middle = axes_of(shape.place.orientation), np.array(shape.place.position)
        own = axes @ np.diag(shape.inertia(part)) @ axes.T
        matrix += own + part * (float(middle @ middle) * np.eye(3) - np.outer(middle, middle))
    return Inertia(mass, (0.0, 0.0, 0.0), matrix)


def names_of_links(links: Iterable[LinkPlan]) -> dict[str, int]:
    """Number the links of a body.

    Args:
        links: the links, the base first.

    Returns:
        Their numbers by name; -1 is the base.
    """
    return {link.name: number for number, link in enumerate(links, -1)}


def names_of_joints(links: Iterable[LinkPlan]) -> dict[str, int]:
    """Number the movable joints of a body.

    Args:
        links: the links, the base first.

    Returns:
        The numbers of the links that they move, by the joints' names.
    """
    return {link.joint.name: number for number, link in enumerate(links, -1) if link.joint is not None}
