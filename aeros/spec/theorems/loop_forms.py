"""Forms of the loops in a module: which treat each element by itself, and which depend on their number.

A loop that goes over all of its elements, ends only after the last one and keeps nothing that a later turn
reads does the same with each element. So if code with two elements is explored for every value of both, the
result holds for any number of them, by induction over the turns. Any other loop, and any expression that
takes a part of a sequence, is reported, and needs an argument of its own.

The check is of the syntax. A loop that calls a function with state is treated like any other; two elements
show such a state if the second turn depends on the first.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

_PARTIAL: Final = frozenset({"islice", "takewhile", "dropwhile", "next", "compress", "filterfalse"})
"""Functions that use a part of what they are given."""

_COUNTING: Final = frozenset({"range", "enumerate", "count"})
"""Functions that number elements."""

_Loop = ast.For | ast.AsyncFor | ast.While | ast.comprehension


class LoopForm(NamedTuple):
    """A loop, or an expression that takes a part of a sequence.

    Attributes:
        place: its function and its text, as `finite_objections: for block in site.blocks`.
        faults: why it may depend on the number of elements; empty if it treats each by itself.
    """

    place: str
    faults: tuple[str, ...]


def loop_forms(source: str) -> list[LoopForm]:
    """List the loops of a module, and the expressions in functions that take a part of a sequence.

    Args:
        source: source of the module.

    Returns:
        Their forms in the order of the source; faults are `slice`, `part`, `number`, `ends early`, `while`,
        and `carries NAME`.
    """
    found: list[LoopForm] = []
    for qualified_name, function in _functions(ast.parse(source), ""):
        for node in _own_nodes(function):
            if isinstance(node, _Loop):
                found.append(LoopForm(f"{qualified_name}: {_head(node)}", _faults(node)))
            elif (fault := _partial(node)) is not None:
                found.append(LoopForm(f"{qualified_name}: {ast.unparse(node)}", (fault,)))
    return found


def _functions(tree: ast.AST, prefix: str) -> Iterator[tuple[str, ast.AST]]:
    """Yield each function below a node with its qualified name; a lambda is a part of what is around it."""
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            name = f"{prefix}{child.name}"
            if not isinstance(child, ast.ClassDef):
                yield name, child
            yield from _functions(child, f"{name}.")
        else:
            yield from _functions(child, prefix)


def _own_nodes(function: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function in the order of the source, without annotations and functions in it."""
    annotations = {getattr(function, field, None) for field in ("annotation", "returns")}
    for child in ast.iter_child_nodes(function):
        if (
            not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            and child not in annotations
        ):
            yield child
            yield from _own_nodes(child)


def _head(loop: _Loop) -> str:
    if isinstance(loop, ast.While):
        return f"while {ast.unparse(loop.test)}"
    return f"for {ast.unparse(loop.target)} in {ast.unparse(loop.iter)}"


def _partial(node: ast.AST) -> str | None:
    """Return the fault of an expression that takes a part of a sequence, or numbers its elements."""
    if isinstance(node, ast.Subscript):
        if any(isinstance(part, ast.Slice) for part in ast.walk(node.slice)):
            return "slice"
        if isinstance(node.slice, ast.BinOp):
            return "number"
    if isinstance(node, ast.Call):
        name = ast.unparse(node.func).rpartition(".")[2]
        if name in _COUNTING:
            return "number"
        if name in _PARTIAL or (name == "zip" and not _is_strict(node)):
            return "part"
    return None


def _is_strict(call: ast.Call) -> bool:
    return any(
        word.arg == "strict" and isinstance(word.value, ast.Constant) and word.value.value is True
        for word in call.keywords
    )


def _faults(loop: _Loop) -> tuple[str, ...]:
    if isinstance(loop, ast.While):
        return ("while",)
    if isinstance(loop, ast.comprehension):
        return ()
    exits = any(isinstance(node, ast.Break | ast.Return) for node in _body_nodes(loop))
    carried = sorted(_carried(loop))
    return (*(["ends early"] if exits else []), *(f"carries {name}" for name in carried))


def _body_nodes(loop: ast.For | ast.AsyncFor) -> Iterator[ast.AST]:
    for statement in loop.body:
        yield statement
        yield from _own_nodes(statement)


def _carried(loop: ast.For | ast.AsyncFor) -> set[str]:
    """List what a turn reads and an earlier turn may have written."""
    written = {name for node in _body_nodes(loop) for name in _written(node)}
    own = {name for node in ast.walk(loop) for name in _loop_variables(node)}
    return _read_before_written(loop.body, own)[0] & written


def _read_before_written(statements: Sequence[ast.stmt], fresh: set[str]) -> tuple[set[str], set[str] | None]:
    """List what statements read before they write it.

    Args:
        statements: the statements, in order.
        fresh: what the same turn has written before them, on every way to them.

    Returns:
        What they read, without `fresh`; and what is written after them on every way, None if no way leads on.
    """
    read: set[str] = set()
    for statement in statements:
        branches: list[Sequence[ast.stmt]] = []
        if isinstance(statement, ast.If):
            read |= _read(statement.test) - fresh
            branches = [statement.body, statement.orelse]
        elif isinstance(statement, ast.With):
            read |= {name for item in statement.items for name in _read(item.context_expr)} - fresh
            bound = [item.optional_vars for item in statement.items if item.optional_vars is not None]
            fresh = fresh | {name for each in bound for node in ast.walk(each) for name in _written(node)}
            branches = [statement.body]
        else:
            read |= _read(statement) - fresh
        if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
            fresh = fresh | {name for node in ast.walk(statement) for name in _written(node)}
        if isinstance(statement, ast.Return | ast.Raise | ast.Continue | ast.Break):
            return read, None
        results = [_read_before_written(branch, fresh) for branch in branches]
        read |= {name for found, _ in results for name in found}
        after = [one for _, one in results if one is not None]
        if branches and not after:
            return read, None
        if branches:
            fresh = set.intersection(*after)
    return read, fresh


def _loop_variables(node: ast.AST) -> set[str]:
    if isinstance(node, ast.For | ast.AsyncFor | ast.comprehension):
        return {one.id for one in ast.walk(node.target) if isinstance(one, ast.Name)}
    return set()


def _written(node: ast.AST) -> set[str]:
    """Return what a node writes: names, attributes, and containers of which a method is called for effect."""
    if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store | ast.Del):
        return {ast.unparse(node)}
    if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store | ast.Del):
        return {ast.unparse(node.value)}
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        called = node.value.func
        if isinstance(called, ast.Attribute) and ast.unparse(called.value) != "self":
            return {ast.unparse(called.value)}
    return set()


def _read(statement: ast.AST) -> set[str]:
    """Return what a statement reads, but for the containers that it only writes to."""
    found: set[str] = set()
    waiting: list[ast.AST] = [statement]
    while waiting:
        node = waiting.pop()
        children = list(ast.iter_child_nodes(node))
        if isinstance(node, ast.AugAssign):
            # `reasons += found` adds to a result; any other operator needs the earlier value.
            children = [node.value]
            if not isinstance(node.op, ast.Add | ast.BitOr):
                found.add(ast.unparse(node.target))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            called = node.value.func
            if isinstance(called, ast.Attribute):
                children = [*node.value.args, *node.value.keywords]
        elif isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store | ast.Del):
            children = [node.slice]
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
            found.add(ast.unparse(node))
        waiting += children
    return found
