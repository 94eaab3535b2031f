"""Names that Python code binds, in every form that binds one."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

_COMPREHENSIONS: Final = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp

_TEXT_FIELDS: Final = frozenset(
    (("Constant", "value"), ("Constant", "kind"), ("ImportFrom", "module"), ("alias", "name"))
)
"""Text in a syntax tree that is no identifier: literals, and names of modules, which are checked as such."""


def identifiers(node: ast.AST) -> Iterator[str]:
    """Yield the identifiers that a node holds itself, whatever they are for.

    Args:
        node: node of a syntax tree.

    Yields:
        Each text field that is an identifier: names, attributes, arguments, keywords, captures of patterns.
    """
    kind = type(node).__name__
    for field, value in ast.iter_fields(node):
        if isinstance(value, str):
            if (kind, field) not in _TEXT_FIELDS and field != "type_comment":
                yield value
        elif isinstance(value, list):
            yield from (one for one in value if isinstance(one, str))
    if isinstance(node, ast.ImportFrom) and node.module != "__future__":
        yield from (part for part in (node.module or "").split(".") if part)
    if isinstance(node, ast.alias):
        yield from (part for part in node.name.split(".") if part != "*")


def bound_names(node: ast.AST, *, nested: bool = False) -> Iterator[str]:
    """Yield every name that a node binds or deletes in the scope in which it stands.

    Args:
        node: statement, expression or whole file.
        nested: include what functions, classes and comprehensions inside the node bind in their own scopes.

    Yields:
        Each name as often as it is bound: by assignment, deletion, definition, import, loop, `as`, walrus or
        pattern.
    """
    pending: list[ast.AST] = [node]
    while pending:
        one = pending.pop()
        yield from names_bound_by(one)
        if nested:
            pending.extend(ast.iter_child_nodes(one))
        else:
            pending.extend(parts_in_same_scope(one))


def names_bound_by(node: ast.AST) -> Sequence[str]:
    """List the names that one node binds or deletes itself.

    Args:
        node: node of a syntax tree; its parts are not looked at, but for the names of an import.

    Returns:
        The names.
    """
    names_of = _BINDERS.get(type(node))
    return () if names_of is None else names_of(node)


def _own_name(node: Any) -> Sequence[str]:
    return () if node.name is None else (node.name,)


_BINDERS: Final[Mapping[type[ast.AST], Callable[[Any], Sequence[str]]]] = {
    ast.Name: lambda node: () if isinstance(node.ctx, ast.Load) else (node.id,),
    ast.FunctionDef: _own_name,
    ast.AsyncFunctionDef: _own_name,
    ast.ClassDef: _own_name,
    ast.ExceptHandler: _own_name,
    ast.MatchAs: _own_name,
    ast.MatchStar: _own_name,
    ast.MatchMapping: lambda node: () if node.rest is None else (node.rest,),
    ast.arg: lambda node: (node.arg,),
    ast.alias: lambda node: (node.asname or node.name.partition(".")[0],),
    ast.Global: lambda node: node.names,
    ast.Nonlocal: lambda node: node.names,
}
"""The names that a node binds itself, for each class of nodes that can bind one."""


def parts_in_same_scope(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of a node that are evaluated in the scope of the node.

    Args:
        node: node of a syntax tree.

    Yields:
        Of a function its decorators, defaults and annotations; of other nodes all parts but inner scopes.
    """
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            yield from (*node.decorator_list, *_defaults(node.args), *_annotations(node.args))
            if node.returns is not None:
                yield node.returns
        case ast.Lambda():
            yield from _defaults(node.args)
        case ast.ClassDef():
            yield from (*node.decorator_list, *node.bases, *node.keywords)
        case ast.comprehension():
            yield from (node.iter, *node.ifs)  # its target is local to the comprehension
        case _:
            yield from ast.iter_child_nodes(node)


def _defaults(arguments: ast.arguments) -> Iterator[ast.expr]:
    yield from arguments.defaults
    yield from (one for one in arguments.kw_defaults if one is not None)


def _annotations(arguments: ast.arguments) -> Iterator[ast.expr]:
    every = (
        *arguments.posonlyargs,
        *arguments.args,
        arguments.vararg,
        *arguments.kwonlyargs,
        arguments.kwarg,
    )
    yield from (one.annotation for one in every if one is not None and one.annotation is not None)
