"""Pictures of a PyBullet client: colour and depth as cameras see them, and pictures painted on rectangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from aeros.files import temporary_folder
from aeros.sim.bullet.client import bullet
from aeros.sim.engine.world import Image
from aeros.sim.geometry import Camera


class Renderer:
    """Renders pictures of one PyBullet client.

    Args:
        client: number of the client.
    """

    def __init__(self, client: int) -> None:
        self.client = client
        # Pictures to apply at the next rendering: a body that wipes changes one at every tick.
        self._unpainted: dict[int, NDArray[np.uint8]] = {}

    def paint(self, body: int, rgb: NDArray[np.uint8]) -> None:
        """Set the picture of a rectangle; it is applied when the next picture is rendered.

        Args:
            body: of `BodyFactory.add_textured_rectangle`.
            rgb: (rows, columns, 3), 0 to 255; rows from the least y, columns from the least x.
        """
        self._unpainted[body] = rgb

    def _paint(self, body: int, rgb: NDArray[np.uint8]) -> None:
        """Apply a picture to a rectangle.

        The TinyRenderer does not notice a change of a texture that it has, and Bullet reads each file name
        only once, so every change is a new texture from a new file.
        """
        with temporary_folder() as scratch:
            path = scratch / "paint.bmp"
            Picture.fromarray(np.ascontiguousarray(rgb[::-1])).save(path)
            texture = bullet.loadTexture(str(path), physicsClientId=self.client)
        bullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=self.client)

    def render(self, camera: Camera) -> Image:
        """Render a picture with the TinyRenderer (about 45 ms at 320 × 240).

        Args:
            camera: in W.

        Returns:
            Colours and depth.
        """
        while self._unpainted:
            self._paint(*self._unpainted.popitem())
        view = bullet.computeViewMatrix(camera.eye, camera.target, camera.up)
        projection = bullet.computeProjectionMatrixFOV(
            camera.field_of_view, camera.width / camera.height, camera.near, camera.far
        )
        _, _, pixels, depth, _ = bullet.getCameraImage(
            camera.width,
            camera.height,
            view,
            projection,
            renderer=bullet.ER_TINY_RENDERER,
            shadow=0,
            flags=bullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self.client,
        )
        shape = (camera.height, camera.width)
        rgb = np.reshape(np.asarray(pixels, dtype=np.uint8), (*shape, 4))[:, :, :3]
        z = np.reshape(np.asarray(depth, dtype=np.float64), shape)
        metres = camera.far * camera.near / (camera.far - (camera.far - camera.near) * z)
        return Image(np.ascontiguousarray(rgb), metres)
