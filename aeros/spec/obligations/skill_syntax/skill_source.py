"""Skill code as text and syntax tree: every claim reads the same program, the one that Python runs.

Python takes the encoding of a file from a byte order mark or a comment, so that the same bytes can be one
program to a reader and another to the interpreter.  Skill code is plain UTF-8 or refused.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
import unicodedata
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Final

from aeros.spec.diagnostics.characters import find_hidden
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.obligations.skill_syntax.bound_names import names_bound_by
from aeros.spec.text.files import hidden_character_error, hidden_path_error

_COOKIE = re.compile(rb"^[ \t\f]*#.*?coding[:=]")  # PEP 263, looked for in the first two lines


MAX_DEPTH: Final = 100
"""Limit on the depth of a syntax tree, so that functions that call themselves can read it."""

Located = ast.expr | ast.stmt | ast.excepthandler | ast.pattern | ast.arg | ast.keyword | ast.alias
"""Nodes of a syntax tree that have a place in the file."""


class UnreadableCodeError(Exception):
    """The bytes are not plain UTF-8 Python; the message gives the reason.

    Attributes:
        diagnostic: report, with the place if there is one.
    """

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.headline)
        self.diagnostic = diagnostic


def _unreadable(path: str, reason: str, help_: str = "write it as plain UTF-8") -> UnreadableCodeError:
    """Make the error for a file in which no one place is at fault."""
    return UnreadableCodeError(Diagnostic("AE139", f"`{path}` is not plain Python: {reason}", help=(help_,)))


class SkillFile:
    """One file of skill code: its text, its syntax tree, all nodes of the tree, and its functions by name.

    Args:
        path: path of the file, for reports.
        content: bytes of the file.

    Raises:
        UnreadableCodeError: the bytes are not plain UTF-8 Python.
    """

    def __init__(self, path: str, content: bytes) -> None:
        self.source = Source(path, _text(path, content))
        _require_visible(self.source)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # Python's advice on style is not ours to pass on
                self.tree = ast.parse(self.source.text)
                self._require_flat()
                compile(self.tree, path, "exec", dont_inherit=True)  # finds what the parser leaves
                _require_ascii_names(self.source)
        except SyntaxError as error:
            raise UnreadableCodeError(_syntax_diagnostic(self.source, error)) from error
        except (ValueError, RecursionError, MemoryError, tokenize.TokenError) as error:
            is_deep = isinstance(error, RecursionError | MemoryError)
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise _unreadable(
                path, reason, "split it up" if is_deep else "write it as plain UTF-8"
            ) from error
        self.nodes = tuple(ast.walk(self.tree))
        self.nodes_in_order = tuple(_nodes_in_order(self.tree))
        self.functions = {node.name: node for node in self.tree.body if isinstance(node, ast.FunctionDef)}
        self._nodes_of: dict[ast.AST, tuple[ast.AST, ...]] = {}

    def _require_flat(self) -> None:
        """Refuse code that is nested too deep.

        Raises:
            UnreadableCodeError: it is.
        """
        layer, depth = list[ast.AST]([self.tree]), 0
        while layer:
            if depth == MAX_DEPTH:
                place = next((one for one in layer if isinstance(one, Located)), None)
                label = None if place is None else SpanLabel(self.span(place))
                headline = f"the code is nested more than {MAX_DEPTH} deep"
                raise UnreadableCodeError(Diagnostic("AE139", headline, label, help=("split it up",)))
            layer = [child for one in layer for child in ast.iter_child_nodes(one)]
            depth += 1

    def nodes_of(self, part: ast.AST) -> tuple[ast.AST, ...]:
        """List a part of the syntax tree and all nodes in it, as `ast.walk` does; each skill asks again.

        Args:
            part: node of the syntax tree.

        Returns:
            The nodes, the part itself first.
        """
        found = self._nodes_of.get(part)
        if found is None:
            found = self._nodes_of[part] = tuple(ast.walk(part))
        return found

    @cached_property
    def dropped_values(self) -> frozenset[ast.expr]:
        """Expressions that are statements, so that nothing takes their values."""
        return frozenset(node.value for node in self.nodes if isinstance(node, ast.Expr))

    @cached_property
    def constants(self) -> dict[str, ast.expr]:
        """Expressions of the names that the file binds once, outside of functions, by `NAME = expression`."""
        assigned: dict[str, ast.expr] = {}
        for statement in self.tree.body:
            match statement:
                case ast.Assign(targets=[ast.Name(id=name)], value=ast.expr() as value):
                    assigned[name] = value
                case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
                    assigned[name] = value
        bound = Counter(name for node in self.nodes for name in names_bound_by(node))
        return {name: value for name, value in assigned.items() if bound[name] == 1}

    @cached_property
    def generators(self) -> frozenset[str]:
        """Names of the functions that yield."""
        return frozenset(name for name, node in self.functions.items() if self._is_generator(node))

    def _is_generator(self, function: ast.FunctionDef) -> bool:
        return any(isinstance(node, ast.Yield | ast.YieldFrom) for node in self.own_nodes_of(function))

    def own_nodes_of(self, function: ast.FunctionDef) -> list[ast.AST]:
        """List the nodes of a function that are in none of its inner functions.

        Args:
            function: the function.

        Returns:
            The nodes, the function itself first.
        """
        nodes = self.nodes_of(function)
        inner = {
            node
            for part in nodes[1:]
            if isinstance(part, ast.FunctionDef | ast.Lambda)
            for node in self.nodes_of(part)
        }
        return [node for node in nodes if node not in inner]

    def span(self, node: Located) -> SourceSpan:
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


def _nodes_in_order(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield every node after the node that it is part of, and before what follows it in the file."""
    pending: list[ast.AST] = [tree]
    while pending:
        node = pending.pop()
        yield node
        pending.extend(reversed(list(ast.iter_child_nodes(node))))


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
    return {path: _read(folder, path, content) for path, content in code.items()}


def _read(folder: str, path: str, content: bytes) -> SkillFile | UnreadableCodeError:
    try:
        _require_visible_path(path)
        return SkillFile(str(Path(folder) / path), content)
    except UnreadableCodeError as error:
        return error


def _require_visible_path(path: str) -> None:
    diagnostic = hidden_path_error(path)
    if diagnostic is not None:
        raise UnreadableCodeError(diagnostic)


def _text(path: str, content: bytes) -> str:
    if content.startswith(b"\xef\xbb\xbf"):
        raise _unreadable(path, "it begins with a byte order mark")
    if any(_COOKIE.match(line) for line in content.split(b"\n", 2)[:2]):
        raise _unreadable(path, "it declares an encoding", "remove that: it is UTF-8 without saying so")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise _unreadable(path, f"byte {error.start} is not UTF-8") from error


def _require_visible(source: Source) -> None:
    offset = find_hidden(source.text)
    if offset is not None:
        raise UnreadableCodeError(hidden_character_error(source.span(offset, offset + 1)))


def _require_ascii_names(source: Source) -> None:
    # Python reads `ｅｘｅｃ` as `exec` (NFKC, PEP 3131), and a reader takes the Cyrillic `а` for an `a`.
    if not any(f"a{one}".isidentifier() for one in set(source.text) if not one.isascii()):
        return  # sooner than by tokens: no name can hold a sign such as `°` or `±`
    for token in tokenize.generate_tokens(io.StringIO(source.text).readline):
        # Until Python 3.12 the names in an f-string are part of its one token.
        prefix = token.string.partition(token.string[-1])[0] if token.type == tokenize.STRING else ""
        is_formatted = "f" in prefix.lower()
        if is_formatted:
            found = next((one for one in token.string if _is_folded_letter(one)), None)
        else:
            found = token.string if token.type == tokenize.NAME and not token.string.isascii() else None
        if found is not None:
            read = unicodedata.normalize("NFKC", found)
            meaning = f", and Python reads it as `{read}`" if read != found else ""
            headline = f"the name `{found}` is not written in ASCII{meaning}"
            start = source.line_start(token.start[0]) + token.start[1] + token.string.index(found)
            label = SpanLabel(source.span(start, start + len(found)))
            help_ = "write names with the letters a to z; comments and texts may use any letters"
            raise UnreadableCodeError(Diagnostic("AE134", headline, label, help=(help_,)))


def _is_folded_letter(character: str) -> bool:
    """Tell if Python takes a character of a name for ASCII ones."""
    return (
        not character.isascii()
        and f"a{character}".isidentifier()
        and unicodedata.normalize("NFKC", character).isascii()
    )


def _syntax_diagnostic(source: Source, error: SyntaxError) -> Diagnostic:
    """Report code that Python cannot read, at the place that Python names."""
    if error.lineno is None or not 0 < error.lineno <= source.text.count("\n") + 1:
        return Diagnostic("AE139", f"`{source.path}` is not Python: {error.msg}")
    line, start = source.line_text(error.lineno), source.line_start(error.lineno)
    first = min(max((error.offset or 1) - 1, 0), max(len(line) - 1, 0))
    last = error.end_offset - 1 if error.end_lineno == error.lineno and error.end_offset else first + 1
    span = source.span(start + first, start + min(max(last, first + 1), len(line)))
    return Diagnostic("AE139", f"this is not Python: {error.msg}", SpanLabel(span))
