"""Layout of texts in tests, and the laws that hold for each."""

from __future__ import annotations

import re

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.layout import format_yaml
from aeros.spec.text.layout.check import has_same_content


def laid_out(text: str) -> str:
    return format_yaml(Source("a.yaml", text))


def check_laws(text: str) -> bool:
    """Check the laws for a text; False if AEROS does not read it."""
    try:
        after = laid_out(text)
    except UserError:
        return False
    assert laid_out(after) == after
    assert has_same_content(text.replace("\r\n", "\n"), after)
    assert "\r" not in after
    return True


def spread(text: str) -> str:
    """Write a text with twice the indentation, and with ends of lines as on Windows."""
    indentation = re.compile(r"^ *(?:- )*", re.MULTILINE)
    text = indentation.sub(lambda found: found[0].replace(" ", "  ").replace("-  ", "-   "), text)
    return text.replace("\n", "\r\n")
