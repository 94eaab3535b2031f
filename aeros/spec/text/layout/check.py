"""Comparison of a file before and after it is laid out: the same values and the same comments."""

from __future__ import annotations

from typing import Any, Final

import yaml

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # PyYAML may be built without libyaml
_KEPT: Final = ("value", "style", "flow_style", "tag", "implicit", "anchor", "explicit", "version", "tags")


def has_same_content(before: str, after: str) -> bool:
    """Compare two texts, without the layout code: parsed anew, and their comments by the scanner's marks.

    Args:
        before: text of a YAML file.
        after: the text that is to take its place.

    Returns:
        True if both have the same values in the same order and styles, and the same comments.
    """
    try:
        return _events(before) == _events(after) and comments_of(before) == comments_of(after)
    except yaml.YAMLError:
        return False


def comments_of(text: str) -> list[str]:
    """Find the comments of a YAML text.

    Args:
        text: the text.

    Returns:
        The comments in their order, without spaces at the end.

    Raises:
        yaml.YAMLError: it is not YAML.
    """
    found: list[str] = []
    at = 0
    for token in yaml.scan(text, Loader=_LOADER):
        start, end = token.start_mark.index, token.end_mark.index
        found += _comments_in(text[at:start])
        if isinstance(token, yaml.ScalarToken) and token.style in ("|", ">"):
            found += _comments_in(text[start:end].partition("\n")[0])
        at = max(at, end)
    return found + _comments_in(text[at:])


def _comments_in(gap: str) -> list[str]:
    """The comments of a text that holds no value: each begins with `#` and ends with its line."""
    return [line[line.index("#") :].rstrip() for line in gap.split("\n") if "#" in line]


def _events(text: str) -> list[tuple[str, dict[str, Any]]]:
    return [
        (type(event).__name__, {name: getattr(event, name, None) for name in _KEPT})
        for event in yaml.parse(text, Loader=_LOADER)
    ]
