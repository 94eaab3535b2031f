"""Changes of values in place, by which skill code could change an action after it was made.

An action is a tuple, so that its parameters are within reach of whoever holds it: by an index, by unpacking,
by a loop.  They never change where every action is yielded at once.  Elsewhere code changes a dict or a list
only under the name to which it assigned a new one, which is never the dict of an action.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Collection, Mapping
from typing import Final

from aeros.spec.obligations.skill_syntax.bound_names import names_bound_by
from aeros.spec.obligations.skill_syntax.neighbours import ModuleFiles, neighbour_imports
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile

_ACTION_NAMES: Final = ("act", "Action")

_CHANGING_METHODS: Final = frozenset(("clear", "pop", "popitem", "setdefault", "update"))
"""Methods that change a dict in place."""

_COPYING_METHODS: Final = frozenset(("copy", "fromkeys", "split"))
_MAKING_BUILTINS: Final = frozenset(
    ("bool", "dict", "float", "frozenset", "int", "len", "list", "set", "sorted", "str", "tuple")
)
_MAKING_EXPRESSIONS: Final = (
    ast.BinOp
    | ast.Compare
    | ast.Constant
    | ast.Dict
    | ast.DictComp
    | ast.GeneratorExp
    | ast.JoinedStr
    | ast.Lambda
    | ast.List
    | ast.ListComp
    | ast.Set
    | ast.SetComp
    | ast.Tuple
    | ast.UnaryOp
)
"""Expressions whose value is no dict, or a new one."""


def first_change_of_actions(path: str, files: ModuleFiles) -> ast.expr | None:
    """Find the first place in a file at which the parameters of an action may change after it was made.

    Args:
        path: path of the file.
        files: skill code that is on the allow-list and may be executed together, the file among it.

    Returns:
        The expression that is changed; None if no action can change.
    """
    if _are_yielded_at_once(files):
        return None
    file = files[path]
    bound = {name for one in files.values() for node in one.nodes for name in names_bound_by(node)}
    new = _names_of_new_values(file, bound)
    changed = [
        base
        for node in file.nodes
        if (base := _changed_by(node)) is not None and not (isinstance(base, ast.Name) and base.id in new)
    ]
    return min(changed, key=lambda one: (one.lineno, one.col_offset), default=None)


def _are_yielded_at_once(files: ModuleFiles) -> bool:
    """Tell if every action is yielded where it is made, and no code of the files receives what is yielded."""
    parents = {
        id(child): node
        for file in files.values()
        for node in file.nodes
        for child in ast.iter_child_nodes(node)
    }
    makers = {path: _yielding_functions(file, parents) for path, file in files.items()}
    for path, file in files.items():
        own = makers[path]
        if own is None:
            return False
        imported = {
            one.local_name
            for one in neighbour_imports(file.tree)
            if one.alias.name in (makers.get(one.path) or ())
        }
        if not _uses_at_once(file, own | imported, parents):
            return False
    return True


def _yielding_functions(file: SkillFile, parents: Mapping[int, ast.AST]) -> set[str] | None:
    """Return the names of the functions that yield; None if anything else does."""
    makers: set[str] = set()
    for node in file.nodes:
        if isinstance(node, ast.Yield | ast.YieldFrom):
            function = parents[id(node)]
            while not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                if isinstance(function, ast.Module | ast.ClassDef):
                    return None
                function = parents[id(function)]
            if isinstance(function, ast.Lambda) or isinstance(parents[id(function)], ast.ClassDef):
                return None
            makers.add(function.name)
    return makers


def _uses_at_once(file: SkillFile, makers: Collection[str], parents: Mapping[int, ast.AST]) -> bool:
    """Tell if a file yields each action where it makes it, and passes on what each of `makers` yields."""
    for node in file.nodes:
        if not isinstance(node, ast.Name) or not isinstance(node.ctx, ast.Load):
            continue
        call = parents[id(node)]
        is_called = isinstance(call, ast.Call) and call.func is node
        if node.id in _ACTION_NAMES and is_called and not isinstance(parents[id(call)], ast.Yield):
            return False
        if node.id in makers and not (is_called and isinstance(parents[id(call)], ast.YieldFrom)):
            return False
    return True


def _names_of_new_values(file: SkillFile, bound: Collection[str]) -> frozenset[str]:
    """Return the names that stand for values which the code made for them, wherever they are bound.

    The names in `bound` stand for something of the module's own code.
    """
    values: dict[str, list[ast.expr]] = defaultdict(list)
    read: set[int] = set()  # names in bindings that are understood
    others: set[str] = set()
    for node in file.nodes:
        match node:
            case ast.Assign(targets=targets, value=value):
                simple = [one for one in targets if isinstance(one, ast.Name)]
            case ast.AnnAssign(target=ast.Name() as target, value=value) if value is not None:
                simple = [target]
            case ast.NamedExpr(target=target, value=value):
                simple = [target]
            case ast.AugAssign(target=ast.Name() as target):
                read.add(id(target))
                continue
            case _:
                continue
        for one in simple:
            read.add(id(one))
            values[one.id].append(value)
    for node in file.nodes:
        if id(node) not in read and not (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Del)):
            others |= set(names_bound_by(node))
    return frozenset(
        name
        for name, given in values.items()
        if name not in others and all(_is_new(value, bound) for value in given)
    )


def _is_new(value: ast.expr, bound: Collection[str]) -> bool:
    """Tell if an expression has a value that nothing else refers to, or none that can be changed."""
    match value:
        case ast.IfExp(body=one, orelse=other):
            return _is_new(one, bound) and _is_new(other, bound)
        case ast.BoolOp(values=parts):
            return all(_is_new(one, bound) for one in parts)
        case ast.Call(func=ast.Name(id=name)):
            return name in _MAKING_BUILTINS and name not in bound
        case ast.Call(func=ast.Attribute(attr=name)):
            return name in _COPYING_METHODS and name not in bound  # a class may have one that copies nothing
    return isinstance(value, _MAKING_EXPRESSIONS)


def _changed_by(node: ast.AST) -> ast.expr | None:
    """Return the expression whose value a node may change in place."""
    match node:
        case ast.Subscript(value=value, ctx=ast.Store() | ast.Del()):
            return value
        case ast.AugAssign(target=ast.Name() as target, op=ast.BitOr()):
            return target
        case ast.Attribute(value=value, attr=name) if name in _CHANGING_METHODS:
            return value
    return None
