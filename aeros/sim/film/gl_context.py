"""Open an OpenGL context that draws into memory, without a display."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

_BACK_ENDS: Final = ("egl", "osmesa", "glfw")
"""Back ends of MuJoCo in the order in which they are tried: graphics card or Mesa; Mesa alone; display."""


class OpenGlError(Exception):
    """There is no OpenGL; the message says what is missing and what to install."""


@contextmanager
def offscreen_context(width: int, height: int) -> Iterator[str]:
    """Make an OpenGL context current; MUJOCO_GL selects the back end, as for MuJoCo itself.

    Args:
        width: of the greatest picture, pixels.
        height: of the greatest picture, pixels.

    Yields:
        Name of the back end.

    Raises:
        OpenGlError: no back end works.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    failures: list[str] = []
    for name in (wanted,) if wanted in _BACK_ENDS else _BACK_ENDS:
        context = _open(name, width, height, failures)
        if context is not None:
            try:
                yield name
            finally:
                context.free()
            return
    raise OpenGlError(
        f"pictures need OpenGL, and none works here: {'; '.join(failures)}. "
        "Install Mesa, as in `apt install libegl1 libgl1-mesa-dri`, or set MUJOCO_GL to a back end that works"
    )


def _open(name: str, width: int, height: int, failures: list[str]) -> Any:
    """Return a current context; None, with the reason in `failures`, if there is none."""
    # PyOpenGL takes its platform from the environment when it is first imported.
    before = os.environ.pop("PYOPENGL_PLATFORM", None)
    try:
        context = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
        context.make_current()
    except Exception as failure:
        failures.append(f"{name}: {str(failure) or type(failure).__name__}")
        return None
    finally:
        if before is not None:
            os.environ["PYOPENGL_PLATFORM"] = before
    return context
