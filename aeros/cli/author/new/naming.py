"""Names and versions of what `aeros new` creates."""

from __future__ import annotations

import argparse
import re
from typing import Final

from packaging.version import Version

import aeros
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.expr.parser import KEYWORDS
from aeros.spec.text.fields import PATTERNS

RESERVED: Final = frozenset({"aeros", "null", "true", "false"}) | KEYWORDS
"""Names that nothing may have: the name of AEROS, and words of YAML and of conditions."""

MOST_CHARACTERS: Final = 60
"""Largest number of characters of a name or phrase; file systems allow about 250 bytes."""


def identifier(text: str) -> str:
    """Parse the name of a module, site or project.

    Args:
        text: The argument.

    Returns:
        The name.

    Raises:
        argparse.ArgumentTypeError: It is no name, is too long, or is reserved.
    """
    form = PATTERNS["identifier"]
    if not form.regex.fullmatch(text):
        stem = text.lower().removesuffix(".yaml").removesuffix(".yml")
        near = re.sub(r"[^a-z0-9_]+", "_", stem).strip("_0123456789")
        hint = f", or `{near}`" if form.regex.fullmatch(near) else ""
        raise argparse.ArgumentTypeError(
            f"`{escape_invisible(text)}` is not a name: write {form.words}, as in `{form.example}`{hint}"
        )
    if len(text) > MOST_CHARACTERS:
        raise argparse.ArgumentTypeError(f"a name has at most {MOST_CHARACTERS} characters")
    if text in RESERVED:
        raise argparse.ArgumentTypeError(f"`{text}` is reserved; choose another name")
    return text


def runtime_range() -> str:
    """Say which versions of AEROS a new module is for.

    Returns:
        A range of versions: those of this minor version.
    """
    version = Version(aeros.__version__)
    return f">={version.major}.{version.minor},<{version.major}.{version.minor + 1}"
