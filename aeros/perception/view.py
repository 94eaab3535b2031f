"""Views: all that a perceiver receives in one call, and the values that it yields.

A perceiver is a generator. It yields the values of the module's own variables by their short names, and
receives the next view. It has no handle to anything else.

    def see_kettle(view: View) -> Perception:
        while True:
            points = view.pictures["overhead"].points()
            height = float(points[:, :, 2].max())
            view = yield {"lid_height": estimate(height, 0.004), "steaming": None}

A variable that is None or absent is unknown. SI units; positions in W.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.points import Vector3, point_cloud


class Estimate(NamedTuple):
    """A measured value with its standard uncertainty and its time.

    Attributes:
        value: SI; a number, or a tuple of three numbers for a position.
        uncertainty: standard uncertainty of each number, SI; None for a value that has none.
        time: plant time at which it was true, s; None for that of the oldest picture in the view.
    """

    value: Any
    uncertainty: float | None
    time: float | None = None


def estimate(value: Any, uncertainty: float | None = None, *, time: float | None = None) -> Estimate:
    """Attach the standard uncertainty, or the time, to a value.

    Args:
        value: SI; a number, or a tuple or array of three numbers for a position.
        uncertainty: standard uncertainty of each number, SI; None for a bool, a count or an enum member.
        time: plant time at which it was true, s, as that of the picture that shows it; by default that of
            the oldest picture in the view, or of the call if there is none.

    Returns:
        The estimate. Its value counts as unknown if the module declares a smaller uncertainty.
    """
    return Estimate(value, uncertainty, time)


class Sample(NamedTuple):
    """A reading that was sampled between two calls.

    Attributes:
        time: plant time of the measurement, s.
        value: SI.
    """

    time: float
    value: Any


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture of one camera, and the place from which the robot believes it was taken.

    `rgb` and `depth` are read-only and hold until the perceiver yields: copy what must stay.

    Attributes:
        camera: name of the camera.
        time: plant time of the picture, s.
        rgb: (height, width, 3), 0 to 255.
        depth: along the optical axis (height, width), m; None if the module did not ask for it.
        eye: position of the camera in W, m.
        target: point in W that it looks at, m.
        up: direction in W that is up in the picture.
        field_of_view: vertical, degrees.
        full_size: width and height of the camera's own picture, pixels, of which this is a sample.
    """

    camera: str
    time: float
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32] | None
    eye: Vector3
    target: Vector3
    up: Vector3
    field_of_view: float
    full_size: tuple[int, int]

    @property
    def width(self) -> int:
        """Number of columns, pixels."""
        return int(self.rgb.shape[1])

    @property
    def height(self) -> int:
        """Number of rows, pixels."""
        return int(self.rgb.shape[0])

    def points(self) -> NDArray[np.float64]:
        """Compute the point of every pixel.

        Returns:
            Points (height, width, 3) in W, m.

        Raises:
            ValueError: the module did not ask for the depth of this camera.
        """
        if self.depth is None:
            raise ValueError(f"the picture of `{self.camera}` has no depth: ask for it with `depth: true`")
        return point_cloud(self.depth, self.eye, self.target, self.up, self.field_of_view, self.full_size)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """All that a perceiver receives in one call.

    Attributes:
        time: plant time of the call, s.
        pictures: newest picture of each camera that the perceiver asked for, by the camera's name.
        readings: values (SI) of the variables that it asked for; an unknown one is absent.
        samples: readings that were sampled since the previous call, oldest first, by the variable's name.
    """

    time: float
    pictures: Mapping[str, Picture]
    readings: Mapping[str, Any]
    samples: Mapping[str, tuple[Sample, ...]]


Perception = Generator[Mapping[str, Any], View, None]
"""Generator of a perceiver: yields values by variable, receives the next view."""
