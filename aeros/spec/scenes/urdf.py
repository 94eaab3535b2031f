"""Check a URDF file before a simulator loads it, and list its links and joints.

A simulator takes NaN for a length, and of a missing mesh it reports only that something could not be
loaded.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Final, NamedTuple
from xml.parsers import expat

from aeros.spec.diagnostics.codes import Diagnostics, quoted
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.files import read_source

_NUMERIC_ATTRIBUTES: Final[Mapping[str, Mapping[str, int]]] = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "dynamics": {"damping": 1, "friction": 1},
    "color": {"rgba": 4},
}
"""Number of numbers in each attribute of an element."""

_POSITIVE_ELEMENTS: Final = {"box", "sphere", "cylinder", "capsule"}
"""Elements whose numbers are lengths of a body, and so positive."""

_MOVABLE_JOINTS: Final = ("revolute", "continuous", "prismatic")

_MAX_NUMBER: Final = 1e6
"""Greatest absolute value of a number, SI."""


class UrdfNames(NamedTuple):
    """Names in a URDF file.

    Attributes:
        links: names of the links, the base first.
        joints: type of each movable joint, `revolute`, `continuous` or `prismatic`, by its name.
    """

    links: tuple[str, ...]
    joints: Mapping[str, str]


def check_urdf(path: Path, diagnostics: Diagnostics) -> UrdfNames:
    """Report all problems of a URDF file: malformed XML, wrong elements, bad numbers and missing meshes.

    Args:
        path: the file.
        diagnostics: receives the diagnostics.

    Returns:
        The names of its links and movable joints, as far as they could be read.

    Raises:
        UserError: the file cannot be read.
    """
    source = read_source(path)
    reader = _Reader(source, path.parent, diagnostics)
    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler = lambda name, attributes: reader.element(
        name, attributes, parser.CurrentByteIndex
    )
    parser.StartDoctypeDeclHandler = lambda *_: reader.doctype(parser.CurrentByteIndex)
    try:
        parser.Parse(source.text.encode(), True)
    except expat.ExpatError as error:
        at = reader.span(parser.ErrorByteIndex)
        diagnostics.error("AE141", f"not well-formed XML: {expat.ErrorString(error.code)}", at)
        return UrdfNames((), {})
    if not reader.links and not diagnostics.has_errors:
        diagnostics.error("AE141", "a model has at least one `link`", reader.span(0))
    base_first = sorted(reader.links, key=lambda link: link in reader.children)
    return UrdfNames(tuple(base_first), reader.joints)


class _Reader:
    """Checks one XML element after the other."""

    def __init__(self, source: Source, folder: Path, diagnostics: Diagnostics) -> None:
        self._source = source
        self._bytes = source.text.encode()
        self._folder = folder
        self._diagnostics = diagnostics
        self._is_first = True
        self.links: list[str] = []
        self.joints: dict[str, str] = {}
        self.children: set[str] = set()

    def span(self, at: int) -> SourceSpan:
        """Return the tag that begins at byte `at`."""
        start = len(self._bytes[:at].decode(errors="ignore"))
        end = self._source.text.find(">", start)
        return self._source.span(start, len(self._source.text) if end < 0 else end + 1)

    def doctype(self, at: int) -> None:
        """Refuse a document type: entities can be made to grow without end, and no model needs them."""
        # expat says where the name of the type ends.
        start = self._bytes.rfind(b"<!DOCTYPE", 0, at)
        self._diagnostics.error("AE141", "DOCTYPE is not allowed", self.span(start))

    def element(self, name: str, attributes: Mapping[str, str], at: int) -> None:
        """Check numbers and files of one element."""
        if self._is_first and name != "robot":
            self._diagnostics.error(
                "AE141", f"the root element must be `robot`, not {quoted(name)}", self.span(at)
            )
        self._is_first = False
        self._note_names(name, attributes)
        for attribute, count in _NUMERIC_ATTRIBUTES.get(name, {}).items():
            if attribute in attributes:
                self._numbers(name, attribute, attributes[attribute], count, at)
        if name == "mesh":
            self._mesh(attributes.get("filename", ""), at)

    def _note_names(self, name: str, attributes: Mapping[str, str]) -> None:
        if name == "link":
            self.links.append(attributes.get("name", ""))
        elif name == "joint" and attributes.get("type") in _MOVABLE_JOINTS:
            self.joints[attributes.get("name", "")] = attributes["type"]
        elif name == "child":
            self.children.add(attributes.get("link", ""))

    def _numbers(self, name: str, attribute: str, text: str, count: int, at: int) -> None:
        least = 1e-6 if name in _POSITIVE_ELEMENTS else -_MAX_NUMBER
        numbers = [_number(part) for part in text.split()]
        if len(numbers) != count or not all(isfinite(number) for number in numbers):
            expected = "a finite number" if count == 1 else f"{count} finite numbers"
            self._diagnostics.error(
                "AE108", f"`{attribute}` of `{name}` is {expected}, and not {quoted(text)}", self.span(at)
            )
        elif not all(least <= number <= _MAX_NUMBER for number in numbers):
            help_ = f"write a value from {least:g} to {_MAX_NUMBER:g}"
            self._diagnostics.error(
                "AE111", f"`{attribute}` of `{name}` is outside its bounds", self.span(at), help=(help_,)
            )

    def _mesh(self, written: str, at: int) -> None:
        file = self._folder / written.removeprefix("package://")
        if not written or not file.is_file():
            self._diagnostics.error(
                "AE002",
                f"there is no file {quoted(str(file))}, the `mesh` of this link",
                self.span(at),
                help=("put it there; `filename` counts from the model's own folder",),
            )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")
