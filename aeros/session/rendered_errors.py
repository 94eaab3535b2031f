"""Give errors in a user's files their full text: file, line, cause and help."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.render import render_all


@contextmanager
def rendered_errors() -> Iterator[None]:
    """Give each `UserError` that leaves the block the text of its diagnostics, as a command prints them.

    Raises:
        UserError: The same exception, with the rendered diagnostics as its `str`.
    """
    try:
        yield
    except UserError as error:
        if error.diagnostics:
            error.text = render_all(error.diagnostics)
        raise
