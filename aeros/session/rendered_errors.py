"""Give errors of a user's files their full text: file, line, cause and cure."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.render import render_all


@contextmanager
def rendered_errors() -> Iterator[None]:
    """Let `UserError`s through with `str(error)` being what a command would print of their diagnostics.

    Raises:
        UserError: The same exception, as it left the block.
    """
    try:
        yield
    except UserError as error:
        if error.diagnostics:
            error.args = (render_all(error.diagnostics),)
        raise
