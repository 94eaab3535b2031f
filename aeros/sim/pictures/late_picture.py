"""A picture that is computed when somebody asks for it, and shows the moment at which it was taken."""

from __future__ import annotations

from collections.abc import Sequence

from aeros.runtime.ports import CameraPicture, CameraView
from aeros.sim.geometry import Camera
from aeros.sim.pictures.ray_caster import Decal, PlacedSolid, cast


class LatePicture:
    """A picture of solids where they were.

    Args:
        name: name of the camera.
        time: plant time at which it was taken, s.
        camera: the camera at that time, in W.
        solids: the solids at that time.
        decals: pictures on surfaces at that time.
    """

    def __init__(
        self,
        name: str,
        time: float,
        camera: Camera,
        solids: Sequence[PlacedSolid],
        decals: Sequence[Decal] = (),
    ) -> None:
        self._name, self._time, self._camera = name, time, camera
        self._solids, self._decals = solids, decals
        self._picture: CameraPicture | None = None

    def picture(self) -> CameraPicture:
        """Compute the picture, at the first call.

        Returns:
            The picture.
        """
        if self._picture is None:
            camera = self._camera
            rgb, depth = cast(camera, self._solids, self._decals)
            view = CameraView(camera.eye, camera.target, camera.up, camera.field_of_view)
            self._picture = CameraPicture(
                self._name, self._time, camera.width, camera.height, rgb.tobytes(), depth.tobytes(), view
            )
        return self._picture
