"""Keys of the dictionaries that a skill returns or a perceiver yields, against those that are declared.

A dictionary that is written where it is returned or yielded is checked, and so is one with a name of its own:
one that the function binds once, to a dictionary that is written out, and takes no key out of.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.obligations.skill_syntax.bound_names import names_bound_by
from aeros.spec.obligations.skill_syntax.mapping_keys import unknown_key
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile

_TAKING_OUT: Final = frozenset({"pop", "popitem", "clear"})
"""Methods of a dictionary after which a key may be gone."""


def undeclared_keys(
    file: SkillFile,
    entry: ast.FunctionDef,
    leaving: type[ast.Return | ast.Yield],
    declared: Collection[str],
    noun: str,
) -> Iterator[Diagnostic]:
    """Find keys of the values of a function that are not declared.

    Args:
        file: the file of the function.
        entry: the function.
        leaving: `Return` for the values that it returns, `Yield` for those that it yields.
        declared: the keys that there may be.
        noun: description of these, as in `an output of wipe`.

    Yields:
        A diagnostic for each place.
    """
    inner = {
        node
        for part in file.nodes_of(entry)[1:]
        if isinstance(part, ast.FunctionDef | ast.Lambda)
        for node in file.nodes_of(part)
    }
    own = [node for node in file.nodes_of(entry) if node not in inner]
    values = [node.value for node in own if isinstance(node, leaving)]
    places = [place for value in values if isinstance(value, ast.Dict) for place in value.keys]
    for name in sorted({value.id for value in values if isinstance(value, ast.Name)}):
        places += _keys_put_under(name, own, file.nodes_of(entry))
    for place in places:
        if isinstance(place, ast.Constant) and isinstance(place.value, str) and place.value not in declared:
            yield unknown_key(file, place, place.value, declared, noun)


def _keys_put_under(name: str, own: list[ast.AST], nodes: Collection[ast.AST]) -> list[ast.expr | None]:
    """List the keys that a named dictionary gets for good; none unless that is certain."""
    if [one for node in nodes for one in names_bound_by(node)].count(name) != 1:
        return []
    keys: list[ast.expr | None] = []
    is_dictionary = False
    for node in own:
        match node:
            case ast.Assign(targets=[ast.Name(id=bound)], value=ast.Dict() as written) if bound == name:
                keys, is_dictionary = [*written.keys, *keys], True
            case ast.AnnAssign(target=ast.Name(id=bound), value=ast.Dict() as written) if bound == name:
                keys, is_dictionary = [*written.keys, *keys], True
            case ast.Subscript(value=ast.Name(id=bound), slice=key, ctx=ast.Store()) if bound == name:
                keys.append(key)
            case ast.Subscript(value=ast.Name(id=bound), ctx=ast.Del()) if bound == name:
                return []
            case ast.Attribute(value=ast.Name(id=bound), attr=method) if bound == name:
                if method in _TAKING_OUT:
                    return []
    return keys if is_dictionary else []
