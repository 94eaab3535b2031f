"""Record a video of a run: frames at equal steps of simulated time, written when the run is over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import Final

from PIL import Image as Picture

from aeros.files import replace_durably
from aeros.sim.engine.world import EngineWorld
from aeros.sim.geometry import Camera

FRAMES_MAX: Final = 90
"""Greatest number of pictures kept; beyond it every second one is dropped and the period doubles."""

FRAMES_PER_SECOND: Final = 8
"""Playback rate, 1/s: six times real time, or faster if pictures were dropped."""

Encoder = Callable[[Sequence[Picture.Image]], bytes]
"""Encodes pictures as the bytes of a video file."""


class VideoError(Exception):
    """The video cannot be made; the message says why."""


class VideoRecorder:
    """Viewer that takes a picture every `period` simulated seconds and writes the video on `close`.

    The file appears complete or not at all: there is none if the run is killed or no tick passed.

    Args:
        path: of the file, whose suffix gives the format: `.webp`, `.gif` or `.mp4`.
        period: simulated time between pictures, s; it doubles whenever `FRAMES_MAX` is exceeded.

    Raises:
        VideoError: there is a file already, none can be made, or `.mp4` needs a missing package.
    """

    def __init__(self, path: Path, period: float = 0.75) -> None:
        _check_path(path)
        self._path = path
        self._encode = _encoder_for(path.suffix)
        self._period = period
        self._next = 0.0
        self._frames: list[Picture.Image] = []

    def tick(self, world: EngineWorld, view: Camera) -> None:
        """Take a picture if one is due.

        Args:
            world: the simulated world.
            view: camera to take it with.
        """
        if world.time < self._next:
            return
        self._frames.append(Picture.fromarray(world.renderer.render(view).rgb))
        if len(self._frames) > FRAMES_MAX:
            self._frames = self._frames[::2]
            self._period *= 2.0
        self._next = world.time + self._period

    def close(self) -> None:
        """Write the video; safe to call twice.

        Raises:
            OSError: it cannot be written.
        """
        frames, self._frames = self._frames, []
        if frames:
            replace_durably(self._path, self._encode(frames))


def _check_path(path: Path) -> None:
    """Make the folder of a video file.

    Raises:
        VideoError: the file exists already, or its folder cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists():
            raise VideoError(f"`{path}` exists already")
        with TemporaryFile(dir=path.parent):
            pass
    except OSError as failure:
        raise VideoError(f"cannot write video `{path}`: {failure.strerror}") from failure


def _encoder_for(suffix: str) -> Encoder:
    """Return the encoder for a file suffix.

    Raises:
        VideoError: the package for the format is not installed.
    """
    if suffix == ".mp4":
        try:
            from aeros.sim.engine.mp4 import encode_mp4
        except ImportError as error:
            missing = f"({error.name} is missing)"
            raise VideoError(f"writing .mp4 needs `pip install 'aeros[video]'` {missing}") from error
        return partial(encode_mp4, per_second=FRAMES_PER_SECOND)
    return partial(_animated, FORMATS[suffix])


FORMATS: Final = {".webp": "WEBP", ".gif": "GIF"}
"""Pillow's names of the formats, by file suffix."""


def _animated(form: str, frames: Sequence[Picture.Image]) -> bytes:
    output = BytesIO()
    first, *rest = frames
    first.save(output, form, save_all=True, append_images=rest, duration=1000 // FRAMES_PER_SECOND, loop=0)
    return output.getvalue()
