"""Skill code as text and syntax tree: every claim reads the same program, the one that Python runs.

Python takes the encoding of a file from a byte order mark or a comment, so that the same bytes can be one
program to a reader and another to the interpreter.  Skill code is plain UTF-8 or refused.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from pathlib import Path

from aeros.spec.diagnostics.source import Source, SourceSpan

_COOKIE = re.compile(rb"^[ \t\f]*#.*?coding[:=]")  # PEP 263, looked for in the first two lines


class UnreadableCodeError(Exception):
    """The bytes are not plain UTF-8 Python; the message gives the reason."""


class SkillFile:
    """One file of skill code: its text, its syntax tree, all nodes of the tree, and its functions by name.

    Args:
        path: path of the file, for reports.
        content: bytes of the file.

    Raises:
        UnreadableCodeError: the bytes are not plain UTF-8 Python.
    """

    def __init__(self, path: str, content: bytes) -> None:
        self.source = Source(path, _text(content))
        try:
            self.tree = ast.parse(self.source.text)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise UnreadableCodeError(_describe_syntax_error(error)) from error
        self.nodes = tuple(ast.walk(self.tree))
        self.functions = {node.name: node for node in self.tree.body if isinstance(node, ast.FunctionDef)}

    def span(self, node: ast.expr | ast.stmt) -> SourceSpan:
        """Locate a node on the line on which it begins.

        Args:
            node: node of the syntax tree.

        Returns:
            The position from the beginning of the node to its end or the end of that line.
        """
        line = self.source.line_text(node.lineno)
        start, end = _column(line, node.col_offset), len(line)
        if node.end_lineno == node.lineno and node.end_col_offset is not None:
            end = max(_column(line, node.end_col_offset), min(start + 1, end))
        offset = self.source.line_start(node.lineno)
        return self.source.span(offset + start, offset + end)


def _column(line: str, byte: int) -> int:
    """Return the number of characters in the first bytes of a line, in which syntax trees count."""
    return len(line.encode()[:byte].decode(errors="ignore"))


def read_skill_files(folder: str, code: Mapping[str, bytes]) -> dict[str, SkillFile | UnreadableCodeError]:
    """Parse each Python file of a module.

    Args:
        folder: path of the module's folder.
        code: bytes of each file by path relative to the folder.

    Returns:
        The parsed file, or the error where it cannot be read, by the same path.
    """
    return {path: _read(str(Path(folder) / path), content) for path, content in code.items()}


def _read(path: str, content: bytes) -> SkillFile | UnreadableCodeError:
    try:
        return SkillFile(path, content)
    except UnreadableCodeError as error:
        return error


def _text(content: bytes) -> str:
    if content.startswith(b"\xef\xbb\xbf"):
        raise UnreadableCodeError("it begins with a byte order mark")
    if any(_COOKIE.match(line) for line in content.split(b"\n", 2)[:2]):
        raise UnreadableCodeError("it declares an encoding; it is UTF-8 without saying so")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise UnreadableCodeError(f"byte {error.start} is not UTF-8") from error


def _describe_syntax_error(error: Exception) -> str:
    where = f"line {error.lineno}: " if isinstance(error, SyntaxError) and error.lineno else ""
    lines = str(error).splitlines()
    return where + (lines[0] if lines else type(error).__name__)
