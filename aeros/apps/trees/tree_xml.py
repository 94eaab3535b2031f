"""Safe reader of behaviour trees in XML: elements with their lines, and no entity is ever expanded.

Source of the format: https://www.behaviortree.dev/docs/learn-the-basics/xml_format
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

from aeros.files import open_regular

MAX_BYTES: Final = 10_000_000
MAX_DEPTH: Final = 200
MAX_FILES: Final = 500
MAX_ELEMENTS: Final = 10_000
"""The most elements of one file; the largest of 1,031 public ones has 133."""

_CURES: Final = {
    expat.errors.codes[expat.errors.XML_ERROR_INVALID_TOKEN]: (
        "; text in attributes needs `&lt;` for `<` and `&amp;` for `&`, and names need quoted values"
    ),
    expat.errors.codes[expat.errors.XML_ERROR_NO_ELEMENTS]: "; the file is empty, or ends too early",
}


class TreeFileError(Exception):
    """File that is not a behaviour tree.

    Attributes:
        path: the file.
        line: line of the fault, from 1.
        reason: the fault and its cure, in words.
    """

    def __init__(self, path: str, line: int, reason: str) -> None:
        super().__init__(path, line, reason)
        self.path = path
        self.line = line
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.reason}"


@dataclass(frozen=True)
class TreeNode:
    """Element of a file.

    Attributes:
        tag: its name.
        attributes: its attributes by name.
        path: the file.
        line: line where it begins, from 1.
        children: the elements inside, in their order.
    """

    tag: str
    attributes: Mapping[str, str]
    path: str
    line: int
    children: list[TreeNode] = field(default_factory=list)


def read_tree_file(path: Path) -> TreeNode:
    """Read a file.

    Args:
        path: the file.

    Returns:
        Its outermost element.

    Raises:
        TreeFileError: it cannot be read, is no well-formed XML, declares a document type, or is too large.
    """
    try:
        with open_regular(path) as file:
            content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "its name is not a path"
        raise TreeFileError(str(path), 1, f"cannot be read: {reason}") from error
    return parse_tree(content, str(path))


def read_tree_files(paths: Iterable[Path]) -> list[TreeNode]:
    """Read files, and those that they include.

    Args:
        paths: the files.

    Returns:
        The outermost element of each, those of included files last; each file once.

    Raises:
        TreeFileError: a file cannot be read, is no tree, or includes more than `MAX_FILES` files.
    """
    found: dict[Path, TreeNode] = {}
    pending: list[tuple[Path, TreeNode | None]] = [(path, None) for path in paths]
    while pending:
        path, included_at = pending.pop(0)
        try:
            resolved = path.resolve()
        except (OSError, RuntimeError) as error:  # a link that leads back to itself
            at = included_at or TreeNode("", {}, str(path), 1)
            reason = f"{path} cannot be read: its links lead in a circle, or cannot be followed"
            raise TreeFileError(at.path, at.line, reason) from error
        if resolved in found:
            continue
        if included_at is not None and len(found) >= MAX_FILES:
            reason = f"more than {MAX_FILES} files are included"
            raise TreeFileError(included_at.path, included_at.line, reason)
        try:
            root = read_tree_file(path)
        except TreeFileError as error:
            if included_at is None or error.line > 1:
                raise
            raise TreeFileError(included_at.path, included_at.line, f"includes {error}") from error
        found[resolved] = root
        for include in (one for one in root.children if one.tag == "include"):
            name = include.attributes.get("path", "")
            if not name or "ros_pkg" in include.attributes:
                reason = (
                    "includes a file of a ROS package; give that file as an argument, and remove this line"
                )
                raise TreeFileError(include.path, include.line, reason)
            pending.append((path.parent / name, include))
    return list(found.values())


def parse_tree(content: bytes, path: str) -> TreeNode:
    """Parse the content of a file.

    Args:
        content: XML.
        path: name of the file, for messages.

    Returns:
        Its outermost element.

    Raises:
        TreeFileError: it is no well-formed XML, declares a document type, or is too large.
    """
    if len(content) > MAX_BYTES:
        raise TreeFileError(path, 1, f"larger than {MAX_BYTES // 1_000_000} MB; split the file")
    parser = expat.ParserCreate()
    found: list[TreeNode] = []
    count = 0
    inside: list[TreeNode] = []

    def refuse(*_: Any) -> None:
        raise TreeFileError(
            path, parser.CurrentLineNumber, "declares a document type or entities; remove the declaration"
        )

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        node = TreeNode(tag, attributes, path, parser.CurrentLineNumber)
        if count > MAX_ELEMENTS:
            raise TreeFileError(path, node.line, f"more than {MAX_ELEMENTS} elements; split the file")
        if len(inside) >= MAX_DEPTH:
            raise TreeFileError(path, node.line, f"nested more than {MAX_DEPTH} deep; use subtrees")
        (inside[-1].children if inside else found).append(node)
        inside.append(node)

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: inside.pop()
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = f"is not well-formed XML: {expat.ErrorString(error.code)}{_CURES.get(error.code, '')}"
        raise TreeFileError(path, error.lineno, reason) from error
    except (LookupError, ValueError) as error:  # an encoding that Python lacks
        raise TreeFileError(
            path, parser.CurrentLineNumber, f"cannot be decoded; save it as UTF-8: {error}"
        ) from error
    return found[0]
