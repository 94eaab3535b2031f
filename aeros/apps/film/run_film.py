"""Make the film of a run from the files in its folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.apps.report_page.run_data import AUDIT, RunData, read_run_data
from aeros.distribution import install_command
from aeros.sim.film_file import FILE as POSES
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.film.film import FilmOptions


class FilmError(Exception):
    """A film that cannot be made; the message says why and what to do."""


@contextmanager
def film_imports() -> Iterator[None]:
    """Import packages of a film; MuJoCo opens OpenGL as MUJOCO_GL says when it is imported.

    Yields:
        Nothing.

    Raises:
        FilmError: A package is missing, or MuJoCo cannot be imported with that OpenGL.
    """
    try:
        yield
    except ImportError as error:
        raise FilmError(f"a film needs {install_command('film')} ({error.name} is missing)") from error
    except (AttributeError, OSError, RuntimeError) as error:
        chosen = os.environ.get("MUJOCO_GL", "")
        raise FilmError(
            f"pictures need OpenGL, and MuJoCo has none with MUJOCO_GL=`{chosen}`: {error}. "
            "Unset it, or set it to egl, osmesa or glfw, whichever is installed, "
            "as by `apt install libegl1 libgl1-mesa-dri` or `apt install libosmesa6`"
        ) from error


def film_run(
    folder: Path,
    path: Path,
    options: FilmOptions,
    sites: Mapping[str, Site],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> bytes:
    """Make the film of a run.

    Args:
        folder: Folder of the run.
        path: The film's file; its suffix gives the format.
        options: Options of the film; without a title, that is the instruction of the run.
        sites: Sites of the run that are available, by digest; bounds are shown only for these.
        progress: Called after each picture with the number of pictures that are done, and of all.

    Returns:
        The bytes of the file.

    Raises:
        FilmError: A file of the run or a package is missing, or nothing can draw.
    """
    for name, cure in (
        (POSES, "`aeros run` records it on the physics plants, unless with --no-film"),
        (AUDIT, ""),
    ):
        if not (folder / name).is_file():
            raise FilmError(f"there is no {name} in `{folder}`" + (f": {cure}" if cure else ""))
    with film_imports():
        from aeros.apps.film.run_captions import RunCaptions
        from aeros.sim.film.encoders import FilmPackageError
        from aeros.sim.film.film import EmptyFilmError, make_film
        from aeros.sim.film.gl_context import OpenGlError
        from aeros.sim.film.recording import RecordingError, read_recording
    run = read_run_data(folder)
    if not run.chain.is_sound:
        raise FilmError(
            f"`{folder / AUDIT}` is not sound, and a film shows its decisions: {run.chain.reason}"
        )
    options = options if options.title else replace(options, title=instruction_of(run))
    try:
        recording = read_recording(folder / POSES)
        return make_film(recording, RunCaptions(run, sites), path, options, progress)
    except (EmptyFilmError, FilmPackageError, OpenGlError, RecordingError) as error:
        raise FilmError(str(error)) from error


def instruction_of(run: RunData) -> str:
    """Return the instruction of a run.

    Args:
        run: Data of the run.

    Returns:
        The instruction; empty if the log names none.
    """
    for kind, details in run.notes:
        if kind == "task-selected":
            return str(details.get("instruction") or details.get("task") or "")
    return ""
