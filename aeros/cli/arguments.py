"""Argument types that several commands share."""

from __future__ import annotations

import argparse
from pathlib import Path


def existing_path(text: str) -> Path:
    """A path at which there is something; what it is, the reader says."""
    path = Path(text)
    try:
        path.stat()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a path"
        raise argparse.ArgumentTypeError(f"`{text}`: {reason}") from error
    return path
