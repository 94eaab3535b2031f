"""An OpenGL context for tests that draw; they are skipped where nothing can draw."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.sim.film.gl_context import OpenGlError, offscreen_context


@pytest.fixture
def opengl() -> Iterator[str]:
    """Name of the back end of a context of 320 by 180 pixels, which is current."""
    try:
        with offscreen_context(320, 180) as name:
            yield name
    except OpenGlError as error:
        pytest.skip(str(error))
