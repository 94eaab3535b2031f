"""Mutants of a file: mutmut's operators, also in decorated functions and in code outside of functions.

A mutant belongs to a *unit*: a function with all that is in it, or a statement outside of functions.  It is
known by the unit's name, a digest of the unit's code and a number, so that results of a unit hold for as
long as its code is the same.
"""

from __future__ import annotations
import __future__

import ast
import hashlib
import textwrap
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType
from typing import Any

import libcst as cst
from libcst.metadata import MetadataWrapper, PositionProvider
from mutmut.mutation.file_mutation import Mutation, MutationVisitor, deep_replace
from mutmut.mutation.mutators import mutation_operators
from mutmut.mutation.pragma_handling import IgnoredCode

_Definition = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, eq=False)
class Unit:
    """A function, or a statement outside of functions.

    Attributes:
        module: its module.
        name: qualified name in the module; of a statement the name that it binds, or its first words.
        digest: of its code without comments and docstring.
        line: first line of the function, decorators included; 0 outside of functions.
        node: its node in the tree of the file.
        classes: names of the classes around it.
    """

    module: str
    name: str
    digest: str
    line: int
    node: cst.CSTNode
    classes: tuple[str, ...]

    @property
    def key(self) -> tuple[str, str]:
        """Name and digest, as results have them."""
        return f"{self.module}:{self.name}", self.digest


@dataclass(frozen=True, eq=False)
class CodeMutant:
    """One fault in a unit.

    Attributes:
        unit: the unit.
        number: from 1, within the unit.
        lines: first and last line of the statement that has the fault.
        in_signature: True if the fault is in the default of a parameter.
        mutation: the node and its replacement.
    """

    unit: Unit
    number: int
    lines: tuple[int, int]
    in_signature: bool
    mutation: Mutation

    def function(self) -> CodeType:
        """Compile the function with the fault; for globals see `run_definition`."""
        node = deep_replace(self.unit.node, self.mutation.original_node, self.mutation.mutated_node)
        return compile_definition(node, self.unit.classes)

    def is_same(self) -> bool:
        """Tell if the mutant compiles to the code of the original, calls of `typing.cast` left out."""
        if not self.unit.line or self.in_signature:
            return False
        old, mutation = self.unit.node, self.mutation
        new = deep_replace(old, mutation.original_node, mutation.mutated_node)
        one, other = (
            compile_definition(node.visit(_WithoutCasts()), self.unit.classes) for node in (old, new)
        )
        return shape_of(one) == shape_of(other)

    def description(self) -> str:
        """Say in one line which mutant it is, with the line, the replaced text and the new one."""
        old, new = (
            " ".join(cst.Module([]).code_for_node(node).split())
            for node in (self.mutation.original_node, self.mutation.mutated_node)
        )
        return f"{self.unit.key[0]} {self.number}, line {self.lines[0]}: {old}  ->  {new}"


class FileMutants:
    """All mutants of one file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        source = path.read_text(encoding="utf-8")
        wrapper = MetadataWrapper(cst.parse_module(source))
        visitor = _Visitor(mutation_operators, IgnoredCode(set(), set(), set()))
        self._lines = _lines_of_functions(ast.parse(source))
        self._unit_of: dict[cst.CSTNode, Unit] = {}
        self._statement_of: dict[cst.CSTNode, cst.CSTNode] = {}
        self._in_signature: set[cst.CSTNode] = set()
        self._positions = wrapper.resolve(PositionProvider)
        self.tree = wrapper.module
        for node in self.tree.body:
            self._label(node, (), None, node)
        wrapper.visit(visitor)
        self.mutants = list(self._numbered(visitor.mutations))

    def _numbered(self, mutations: Sequence[Mutation]) -> Iterator[CodeMutant]:
        counts: dict[tuple[str, str], int] = defaultdict(int)
        for mutation in mutations:
            node = mutation.original_node
            unit = self._unit_of[node]
            counts[unit.key] += 1
            yield CodeMutant(
                unit,
                counts[unit.key],
                self._span(self._statement_of[node]),
                node in self._in_signature,
                mutation,
            )

    def whole(self, mutant: CodeMutant) -> str:
        """Return the text of the whole file with the fault of a mutant."""
        mutation = mutant.mutation
        return str(deep_replace(self.tree, mutation.original_node, mutation.mutated_node).code)

    def _span(self, statement: cst.CSTNode) -> tuple[int, int]:
        """Lines of a statement, of a compound one those before its body."""
        at = self._positions[statement]
        body = getattr(statement, "body", None)
        if isinstance(body, cst.BaseSuite):
            return at.start.line, max(at.start.line, self._positions[body].start.line - 1)
        return at.start.line, at.end.line

    def _label(
        self, node: cst.CSTNode, classes: tuple[str, ...], unit: Unit | None, statement: cst.CSTNode
    ) -> None:
        """Say of a node and all below it which unit and statement they are of."""
        if isinstance(
            node, (cst.BaseCompoundStatement, cst.SimpleStatementLine, cst.ExceptHandler, cst.MatchCase)
        ):
            statement = node
            if unit is None:
                inside = isinstance(node, cst.FunctionDef)
                made = self._unit(node, classes)
                self._unit_of[node] = made
                unit = made if inside or isinstance(node, cst.SimpleStatementLine) else None
                below = (*classes, node.name.value) if isinstance(node, cst.ClassDef) else classes
                for child in node.children:
                    is_body = isinstance(child, cst.IndentedBlock) and unit is None
                    self._label(child, below, None if is_body else made, statement)
                return
        if unit is not None:
            self._unit_of[node] = unit
        self._statement_of[node] = statement
        if isinstance(node, cst.Parameters) and isinstance(statement, cst.FunctionDef):
            self._in_signature.update(_below(node))
        for child in node.children:
            self._label(child, classes, unit, statement)

    def _unit(self, node: cst.CSTNode, classes: tuple[str, ...]) -> Unit:
        header: cst.CSTNode = node
        line = 0
        if isinstance(node, cst.FunctionDef):
            name = node.name.value
            line = self._lines[".".join((*classes, name))].pop(0)
        elif isinstance(node, cst.ClassDef):
            name = node.name.value
            header = node.with_changes(body=cst.IndentedBlock([cst.SimpleStatementLine([cst.Pass()])]))
        else:
            name = _bound_name(node) or " ".join(self.tree.code_for_node(node).split()[:3])
        text = textwrap.dedent(self.tree.code_for_node(header))
        qualified = ".".join((*classes, name)) + ("" if line or not isinstance(node, cst.ClassDef) else ":")
        return Unit(self.module, qualified, digest_of(text), line, node, classes)


class _Visitor(MutationVisitor):
    """mutmut's visitor, which also enters decorated functions; it leaves out decorators themselves."""

    def _skip_node_and_children(self, node: cst.CSTNode) -> bool:
        if isinstance(node, cst.FunctionDef) and node.decorators:
            node = node.with_changes(decorators=[])
        return bool(super()._skip_node_and_children(node))


class _WithoutCasts(cst.CSTTransformer):
    """Replaces `cast(TYPE, VALUE)` with VALUE, which is all that it returns."""

    def leave_Call(self, original_node: cst.Call, updated_node: cst.Call) -> cst.BaseExpression:  # noqa: N802
        is_cast = isinstance(updated_node.func, cst.Name) and updated_node.func.value == "cast"
        if is_cast and len(updated_node.args) == 2:
            return updated_node.args[1].value.with_changes(lpar=[cst.LeftParen()], rpar=[cst.RightParen()])
        return updated_node


def shape_of(code: CodeType) -> tuple[Any, ...]:
    """Return everything about code that decides what it does, line numbers left out."""
    constants = tuple(
        shape_of(one) if isinstance(one, CodeType) else (type(one), repr(one)) for one in code.co_consts
    )
    return (code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_flags, constants)


def digest_of(text: str) -> str:
    """Digest the code of a unit; comments, layout and the docstring of a function do not count."""
    tree = ast.parse(text)
    first = tree.body[0]
    if isinstance(first, _Definition) and ast.get_docstring(first) is not None:
        first.body[:1] = []
    return hashlib.sha256(ast.unparse(tree).encode()).hexdigest()[:12]


def compile_definition(node: cst.FunctionDef, classes: Sequence[str]) -> CodeType:
    """Compile a function by itself, in empty classes of the names of those around it."""
    definition: cst.BaseStatement = node.with_changes(decorators=[], leading_lines=[])
    for name in reversed(classes):
        definition = cst.ClassDef(cst.Name(name), cst.IndentedBlock([definition]))
    text = cst.Module([definition]).code
    code: CodeType = compile(
        text, "<mutant>", "exec", __future__.annotations.compiler_flag, dont_inherit=True
    )
    return code


def _lines_of_functions(tree: ast.Module) -> dict[str, list[int]]:
    """First lines of functions as code objects have them, by qualified name, in the order of the file."""
    found: dict[str, list[int]] = defaultdict(list)

    def look(nodes: Sequence[ast.stmt], classes: tuple[str, ...]) -> None:
        for node in nodes:
            if isinstance(node, _Definition):
                first = node.decorator_list[0].lineno if node.decorator_list else node.lineno
                found[".".join((*classes, node.name))].append(first)
                continue
            inner = (*classes, node.name) if isinstance(node, ast.ClassDef) else classes
            for field in ("body", "orelse", "handlers", "finalbody"):
                below = getattr(node, field, [])
                if isinstance(below, list):
                    look([one for one in below if isinstance(one, ast.stmt)], inner)

    look(tree.body, ())
    return found


def _bound_name(node: cst.CSTNode) -> str:
    if not isinstance(node, cst.SimpleStatementLine):
        return ""
    (first, *_) = node.body
    target = first.target if isinstance(first, cst.AnnAssign) else None
    if isinstance(first, cst.Assign):
        target = first.targets[0].target
    return target.value if isinstance(target, cst.Name) else ""


def _below(node: cst.CSTNode) -> Iterator[cst.CSTNode]:
    yield node
    for child in node.children:
        yield from _below(child)
