"""Distances of an arm's meshes from boxes, by Pinocchio and Coal, without AEROS.

`pip install pin coal`. Pinocchio reads the URDF and places its links; Coal computes the distance between the
triangles of each mesh and a solid box. A motion is sampled so densely that no joint moves by more than 2 mrad
between two samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import ceil
from pathlib import Path
from typing import Any, Final

import numpy as np

STEP: Final = 2e-3
"""Greatest change of a joint between two samples, rad."""

_GAP: Final = 0.04
"""Place of each finger beside the hand's axis, m: the hand is open."""


class MeshJudge:
    """Distances of the links beyond the shoulder from boxes.

    Args:
        urdf: the arm, with its collision meshes.
        zones: each with `name`, `lower` and `upper`, m, in the frame of the URDF's base.
        first: number of the first link that counts.
    """

    def __init__(self, urdf: Path, zones: Sequence[Mapping[str, Any]], first: int = 3) -> None:
        import coal
        import pinocchio as pin

        self._pin, self._coal = pin, coal
        self._model = pin.buildModelFromUrdf(str(urdf))
        self._geometry = pin.buildGeomFromUrdf(
            self._model, str(urdf), pin.GeometryType.COLLISION, package_dirs=[str(urdf.parent)]
        )
        self._data = self._model.createData()
        self._places = self._geometry.createData()
        self._parts = [
            index
            for index, part in enumerate(self._geometry.geometryObjects)
            if not any(f"link{number}_" in f"{part.name}_" for number in range(first))
        ]
        self._boxes = [(zone["name"], *self._box(zone)) for zone in zones]

    @property
    def parts(self) -> list[str]:
        """Names of the parts that count."""
        return [self._geometry.geometryObjects[index].name for index in self._parts]

    def distance(self, start: Sequence[float], end: Sequence[float]) -> dict[str, float]:
        """Measure how near a straight motion of the joints comes to each box.

        Args:
            start: joint positions at the start, rad.
            end: joint positions at the end, rad.

        Returns:
            The least distance by the box's name, m; at most 0 where a link is in it.
        """
        first, last = np.array(start), np.array(end)
        count = max(1, ceil(float(np.abs(last - first).max()) / STEP))
        least = {name: float("inf") for name, *_ in self._boxes}
        for share in np.linspace(0.0, 1.0, count + 1):
            q = self._full(first + share * (last - first))
            self._pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._places, q)
            for index, (name, shape, place) in product(self._parts, self._boxes):
                least[name] = min(least[name], self._between(index, shape, place))
        return least

    def _full(self, q: Any) -> Any:
        """Add joints of fingers, which stay open, to the joints of the arm."""
        whole = np.full(self._model.nq, _GAP)
        whole[: len(q)] = q
        return whole

    def _between(self, index: int, shape: Any, place: Any) -> float:
        part, pose = self._geometry.geometryObjects[index], self._places.oMg[index]
        asked, found = self._coal.DistanceRequest(), self._coal.DistanceResult()
        where = self._coal.Transform3s(pose.rotation, pose.translation)
        return float(self._coal.distance(part.geometry, where, shape, place, asked, found))

    def _box(self, zone: Mapping[str, Any]) -> tuple[Any, Any]:
        lower, upper = np.array(zone["lower"]), np.array(zone["upper"])
        return self._coal.Box(*(upper - lower)), self._coal.Transform3s(np.eye(3), (lower + upper) / 2.0)
