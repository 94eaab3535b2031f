"""Make a film of a recording: choose pictures, draw them with their captions, and encode them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from aeros.sim.film.cameraman import CameraMode, close_camera, plan_cameras
from aeros.sim.film.captions import Caption, CaptionSource
from aeros.sim.film.encoders import open_encoder
from aeros.sim.film.film_model import FilmModel
from aeros.sim.film.film_span import FilmSpan
from aeros.sim.film.gl_context import offscreen_context
from aeros.sim.film.marks import marks_of, tool_path
from aeros.sim.film.overlay import Overlay, mark_detections
from aeros.sim.film.person_shapes import Stance, stances_of
from aeros.sim.film.recording import PICTURES_PER_SECOND, PoseSample, Recording
from aeros.sim.film.scene_pictures import ScenePictures
from aeros.sim.geometry import Camera

Progress = Callable[[int, int], None]
"""Called after each picture with the number of pictures that are done, and of all."""

_RATES: Final = {".mp4": 30, ".webp": 15, ".gif": 10}
"""Pictures per second, by file suffix."""


@dataclass(frozen=True)
class FilmOptions:
    """Options of a film.

    Attributes:
        size: width and height, pixels.
        speed: seconds of the run in one second of the film.
        camera: `orbit` turns slowly around the arm, `fixed` stands.
        start: time in the run at which it begins, s.
        end: time in the run at which it ends, s; None for the end of the run.
        title: text at its top.
        has_captions: True to draw captions and marks.
        has_insets: True to draw what cameras see beside captions.
        has_shadows: False to draw no shadows where there are no captions, in a third of the time.
    """

    size: tuple[int, int] = (1280, 720)
    speed: float = 1.0
    camera: CameraMode = "orbit"
    start: float = 0.0
    end: float | None = None
    title: str = ""
    has_captions: bool = True
    has_insets: bool = True
    has_shadows: bool = True


class EmptyFilmError(Exception):
    """No picture of the recording is in the part that was asked for."""


def make_film(
    recording: Recording,
    caption_at: CaptionSource,
    path: Path,
    options: FilmOptions,
    progress: Progress = lambda done, total: None,
) -> bytes:
    """Make a film.

    Args:
        recording: the recording.
        caption_at: returns the caption at a time of the run.
        path: of the file; its suffix gives the format.
        options: options of the film.
        progress: called after each picture.

    Returns:
        The bytes of the file.

    Raises:
        EmptyFilmError: there is no picture between start and end.
        FilmPackageError: a package for the format is missing.
        OpenGlError: nothing here can draw.
    """
    rate = _RATES[path.suffix]
    frames = FilmFrames(recording, caption_at, options, rate)
    span = FilmSpan(options.start, options.start + len(frames) * options.speed / rate, options.speed)
    encoder = open_encoder(path, options.size, rate, span.comment())
    for number, picture in enumerate(frames.pictures(), start=1):
        encoder.add(picture)
        progress(number, len(frames))
    return encoder.finish()


class FilmFrames:
    """The pictures of a film.

    Args:
        recording: the recording.
        caption_at: returns the caption at a time of the run.
        options: options of the film.
        rate: pictures per second of the film.

    Raises:
        EmptyFilmError: there is no picture between start and end.
    """

    def __init__(
        self, recording: Recording, caption_at: CaptionSource, options: FilmOptions, rate: float
    ) -> None:
        self._recording = recording
        self._caption_at = caption_at
        self._options = options
        self._rate = rate
        self._chosen = _choose(recording.samples, options, rate)
        stances = stances_of([sample.people for sample in recording.samples])
        self._stances: list[list[Stance]] = [stances[number] for number in self._chosen]
        self._samples = [recording.samples[number] for number in self._chosen]

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self._chosen)

    def pictures(self) -> Iterator[NDArray[np.uint8]]:
        """Draw the pictures.

        Yields:
            Each picture (height, width, 3), 0 to 255.

        Raises:
            OpenGlError: nothing here can draw.
        """
        options, size = self._options, self._options.size
        cameras = plan_cameras(self._recording, self._samples, options.camera, size, self._rate)
        overlay = Overlay(size, options.title)
        insets = _Insets(self._recording, overlay.inset_size())
        with offscreen_context(*size):
            film = FilmModel(self._recording, size)
            pictures = ScenePictures(film, size)
            for sample, stances, camera in zip(self._samples, self._stances, cameras, strict=True):
                if not options.has_captions:
                    film.place(sample, stances)
                    yield pictures.draw(camera, has_shadows=options.has_shadows)
                    continue
                caption = self._caption_at(sample.time)
                seen = insets.latest(caption, film, pictures) if options.has_insets else ()
                film.place(sample, stances)
                drawn = pictures.draw(camera, marks_of(sample, caption, self._recording.stage.robot))
                if options.has_insets:
                    seen = (*seen, insets.close(sample, camera, pictures))
                yield overlay.draw(drawn, caption, _clock(sample.time, options.speed), seen)


class _Insets:
    """Pictures of the robot's cameras, drawn anew when one took another, and of a camera near the hand."""

    def __init__(self, recording: Recording, size: tuple[int, int]) -> None:
        self._recording = recording
        self._size = size
        self._known: tuple[str, float] | None = None
        self._drawn: Image.Image | None = None
        self._times = [sample.time for sample in recording.samples]

    def latest(
        self, caption: Caption, film: FilmModel, pictures: ScenePictures
    ) -> tuple[tuple[str, Image.Image], ...]:
        """Return label and picture of the camera that took the latest picture; nothing before any."""
        index = min(int(np.searchsorted(self._times, caption.pictured_at)), len(self._times) - 1)
        sample, at_start = self._recording.samples[index], self._recording.stage.cameras
        camera = sample.cameras.get(caption.camera) or at_start.get(caption.camera)
        if camera is None:
            return ()
        width, height = self._size
        share = min(width / camera.width, height / camera.height)
        small = replace(
            camera, width=max(2, round(share * camera.width)), height=max(2, round(share * camera.height))
        )
        key = (caption.camera, caption.pictured_at)
        if key != self._known or self._drawn is None:
            film.place(sample, [])
            self._drawn, self._known = _image(pictures.draw(small)), key
        unit = height / 204.0
        marked = mark_detections(self._drawn, small, caption.detections, unit)
        return ((f"camera {caption.camera}, {caption.pictured_at:.1f} s", marked),)

    def close(self, sample: PoseSample, main: Camera, pictures: ScenePictures) -> tuple[str, Image.Image]:
        """Return label and picture of a camera near the hand."""
        (tool,) = tool_path(self._recording.stage.robot, [sample.joints], sample.base)
        return "the hand", _image(pictures.draw(close_camera(tool, main, self._size), has_shadows=False))


def _image(picture: NDArray[np.uint8]) -> Image.Image:
    return Image.fromarray(np.ascontiguousarray(picture))


def _choose(samples: Sequence[PoseSample], options: FilmOptions, rate: float) -> list[int]:
    """Choose the numbers of the pictures of a film.

    Raises:
        EmptyFilmError: there are none.
    """
    end = samples[-1].time if options.end is None else min(options.end, samples[-1].time)
    times = np.array([sample.time for sample in samples])
    wanted = np.arange(options.start, end + 0.5 / PICTURES_PER_SECOND, options.speed / rate)
    if not len(wanted):
        raise EmptyFilmError(
            f"nothing was recorded after {options.start:g} s: the recording ends at {samples[-1].time:.1f} s"
        )
    chosen: list[int] = np.clip(np.searchsorted(times, wanted - 1e-6), 0, len(times) - 1).tolist()
    return chosen


def _clock(time: float, speed: float) -> str:
    return f"{time:.1f} s" + ("" if speed == 1.0 else f"   {speed:g} times as fast")
