"""The port of a world with physics: its clock, its steps, and the poses, contacts and pictures after them.

Frame W: origin on the table top (or floor) under the arm's base, z up. SI units; quaternions x, y, z, w.
Bodies and links have numbers, which each engine gives; the base of a body is its link -1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Camera, Pose, Vector3

GRAVITY: Final = 9.81
"""Standard acceleration, m/s², rounded as PyBullet's examples do."""

Rgba = tuple[float, float, float, float]
"""Red, green, blue and alpha in [0, 1]."""

PERSON_COLOUR: Final[Rgba] = (0.30, 0.42, 0.50, 1.0)
"""Colour of the clothes of simulated people."""


class Image(NamedTuple):
    """A rendered picture.

    Attributes:
        rgb: (height, width, 3), 0 to 255.
        depth: along the optical axis (height, width), m.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float64]


class Contact(NamedTuple):
    """A contact point of a first body with a second.

    Attributes:
        link_a: number of the first body's link.
        link_b: number of the second body's link.
        body_b: number of the second body.
        position: in W, m.
        normal: unit vector in W, towards the first body.
        force: normal force, N.
    """

    link_a: int
    link_b: int
    body_b: int
    position: Vector3
    normal: Vector3
    force: float


class EngineRenderer(Protocol):
    """Pictures of a world, and pictures painted on rectangles in it."""

    def paint(self, body: int, rgb: NDArray[np.uint8]) -> None:
        """Set the picture of a rectangle; it is applied when the next picture is rendered.

        Args:
            body: number that `Engine.add_painted_rectangle` returned.
            rgb: (rows, columns, 3), 0 to 255; rows from the least y, columns from the least x.
        """

    def render(self, camera: Camera) -> Image:
        """Render a picture.

        Args:
            camera: in W.

        Returns:
            Colours and depth.
        """


class EngineWorld(Protocol):
    """A world in a physics engine.

    Attributes:
        ticks: number of steps since the clock was set to 0.
    """

    ticks: int

    @property
    def time(self) -> float:
        """Simulated time, s."""

    @property
    def renderer(self) -> EngineRenderer:
        """Takes pictures."""

    def step(self) -> None:
        """Advance by one tick."""

    def close(self) -> None:
        """End the simulation; safe to call twice."""

    def push(self, body: int, force: Vector3) -> None:
        """Push a body's base at its centre of mass in the next step.

        Args:
            body: its number.
            force: in W, N.
        """

    def pose(self, body: int, link: int = -1) -> Pose:
        """Read the pose of a body's base, or of a link's frame.

        Args:
            body: its number.
            link: number of the link; -1 for the base, whose pose is that of its centre of mass.

        Returns:
            The pose in W.
        """

    def frame_pose(self, body: int) -> Pose:
        """Read the pose of a body's own frame, in which its file or declaration describes it.

        Args:
            body: its number.

        Returns:
            The pose in W.
        """

    def joint_position(self, body: int, joint: int) -> float:
        """Read the position of a joint.

        Args:
            body: number of its body.
            joint: number of the joint.

        Returns:
            The position, rad or m.
        """

    def contacts(self, body: int, other: int | None = None, link: int | None = None) -> Sequence[Contact]:
        """List the contact points of a body after the last step.

        Args:
            body: its number.
            other: only contacts with this body.
            link: only contacts of this link of `body`.

        Returns:
            The contacts, `body` first.
        """

    def first_on_way(self, start: Vector3, end: Vector3) -> tuple[int, float] | None:
        """Find what a ray meets first; people are not met.

        Args:
            start: in W, m.
            end: in W, m.

        Returns:
            Number of the body, and the way that was left to the end, m; None if the way is free.
        """

    def overlaps(self, deeper_than: float) -> Sequence[tuple[int, int, float]]:
        """List all pairs of bodies that overlap.

        Args:
            deeper_than: least depth that counts, m.

        Returns:
            The two bodies' numbers and the depth, m, of each pair.
        """
