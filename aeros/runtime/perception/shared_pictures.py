"""Memory with pictures that a worker maps for reading and the runtime alone writes."""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterable, Mapping
from typing import Final

from aeros.runtime.isolation.protocol import PictureFacts, PictureSlot
from aeros.runtime.ports import CameraPicture
from aeros.spec.model.perception import PictureRequest

_ALIGNMENT: Final = 64
"""Alignment of each part, bytes; NumPy needs 4 for depth."""


class UnfitPictureError(Exception):
    """A picture is not what was asked for; the message says how."""


class SharedPictures:
    """Memory for the pictures that a perceiver asks for.

    The worker gets a descriptor that was opened for reading alone. So it can neither write the memory, nor
    make its mapping writable, nor change its size.

    Attributes:
        slots: places of the pictures, in the order of the requests.
        size: bytes.
        descriptor: descriptor to hand to the worker, open for reading alone.

    Args:
        requests: pictures that the perceiver asks for.
    """

    def __init__(self, requests: Iterable[PictureRequest]) -> None:
        slots, end = [], 0
        for request in requests:
            pixels = request.width * request.height
            rgb, end = end, _aligned(end + 3 * pixels)
            depth = end if request.depth else None
            end = _aligned(end + 4 * pixels) if request.depth else end
            slots.append(PictureSlot(request.name, request.width, request.height, rgb, depth))
        self.slots = tuple(slots)
        self.size = end
        writable = os.memfd_create("aeros-pictures", os.MFD_CLOEXEC)
        try:
            os.ftruncate(writable, max(end, 1))
            self._memory = mmap.mmap(writable, max(end, 1))
            self.descriptor = os.open(f"/proc/self/fd/{writable}", os.O_RDONLY | os.O_CLOEXEC)
        finally:
            os.close(writable)

    def write(self, pictures: Mapping[str, CameraPicture]) -> tuple[PictureFacts | None, ...]:
        """Write the newest picture of each slot.

        Args:
            pictures: pictures by camera.

        Returns:
            Time and place of each picture, in the order of the slots; None where there is none.

        Raises:
            UnfitPictureError: a picture is smaller than its slot, or lacks a depth that was asked for.
        """
        facts: list[PictureFacts | None] = []
        for slot in self.slots:
            picture = pictures.get(slot.camera)
            if picture is None:
                facts.append(None)
                continue
            rgb, depth = sample(picture, (slot.width, slot.height), with_depth=slot.depth is not None)
            self._memory[slot.rgb : slot.rgb + len(rgb)] = rgb
            if slot.depth is not None and depth is not None:
                self._memory[slot.depth : slot.depth + len(depth)] = depth
            facts.append(PictureFacts(picture.time, *picture.view, full_size=(picture.width, picture.height)))
        return tuple(facts)

    def close(self) -> None:
        """Release the memory at this end."""
        self._memory.close()
        os.close(self.descriptor)


def sample(picture: CameraPicture, size: tuple[int, int], *, with_depth: bool) -> tuple[bytes, bytes | None]:
    """Sample a picture at the resolution that was asked for; a perceiver never sees more.

    Args:
        picture: the camera's picture.
        size: width and height to sample, pixels.
        with_depth: True if the depth is wanted.

    Returns:
        Colours and depth of the sample; no depth if it is not wanted.

    Raises:
        UnfitPictureError: the picture is smaller, or lacks the wanted depth.
    """
    # Needs NumPy, which the runtime does without where no module perceives.
    from aeros.perception.points import sample_picture

    full = (picture.width, picture.height)
    if size[0] > full[0] or size[1] > full[1]:
        raise UnfitPictureError(
            f"the camera `{picture.camera}` delivers {full[0]} x {full[1]} pixels, "
            f"and {size[0]} x {size[1]} are asked for"
        )
    if with_depth and picture.depth is None:
        raise UnfitPictureError(f"the camera `{picture.camera}` measures no depth")
    depth = sample_picture(picture.depth, 4, full, size) if with_depth and picture.depth else None
    return sample_picture(picture.rgb, 3, full, size), depth


def _aligned(offset: int) -> int:
    return -(-offset // _ALIGNMENT) * _ALIGNMENT
