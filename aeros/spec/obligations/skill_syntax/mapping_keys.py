"""Keys with which code asks a mapping that it is given, such as an observation, and that are never there.

Only what is certain is reported: a key that is written out, of a name that can only be that mapping.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable, Iterator
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.obligations.skill_syntax.bound_names import names_bound_by
from aeros.spec.obligations.skill_syntax.skill_source import Located, SkillFile

_MAX_LISTED: Final = 8


def parameters_of_type(function: ast.FunctionDef, type_name: str) -> list[str]:
    """List the parameters of a function that are annotated with a type.

    Args:
        function: the function.
        type_name: name of the type, as in `Observation`.

    Returns:
        Names of the parameters, in order.
    """
    arguments = (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)
    return [
        one.arg
        for one in arguments
        if isinstance(one.annotation, ast.Name) and one.annotation.id == type_name
    ]


def missing_keys(
    file: SkillFile,
    function: ast.FunctionDef,
    name: str,
    known: Collection[str],
    noun: str,
    attribute: str | None = None,
) -> Iterator[Diagnostic]:
    """Find the keys with which a mapping is asked and that it never has.

    Args:
        file: the file of the function.
        function: the function.
        name: its parameter that is the mapping, or that has it as an attribute.
        known: the keys that the mapping may have.
        noun: description of these, as in `an input of wipe`.
        attribute: the attribute that is the mapping; None if it is the parameter.

    Yields:
        A diagnostic for each place.
    """
    if not _is_only_bound_to_observations(file, function, name):
        return
    for node in file.nodes_of(function):
        match node:
            case ast.Subscript(value=mapping, slice=ast.Constant(value=str(key)) as place):
                pass
            case ast.Call(
                func=ast.Attribute(value=mapping, attr="get"),
                args=[ast.Constant(value=str(key)) as place, *_],
            ):
                pass
            case _:
                continue
        match mapping:
            case ast.Name(id=asked):
                is_asked = asked == name and attribute is None
            case ast.Attribute(value=ast.Name(id=asked), attr=part):
                is_asked = asked == name and part == attribute
            case _:
                is_asked = False
        if is_asked and key not in known:
            yield unknown_key(file, place, key, known, noun)


def listed_names(names: Iterable[str]) -> str:
    """List the first names, each in backquotes.

    Args:
        names: in any number.

    Returns:
        The list; empty if there is none.
    """
    return ", ".join(f"`{name}`" for name in list(names)[:_MAX_LISTED])


def unknown_key(file: SkillFile, place: Located, key: str, known: Collection[str], noun: str) -> Diagnostic:
    """Report a key that there never is.

    Args:
        file: the file with the key.
        place: the place of the key.
        key: the key.
        known: the keys that there are.
        noun: description of these, as in `an input of wipe`.

    Returns:
        The diagnostic.
    """
    near = did_you_mean(key, known)
    listed = listed_names(known) or "none"
    help_ = f"did you mean `{near}`?" if near else f"there are {listed}"
    return Diagnostic("AE147", f"`{key}` is not {noun}", SpanLabel(file.span(place)), help=(help_,))


def _is_only_bound_to_observations(file: SkillFile, function: ast.FunctionDef, name: str) -> bool:
    """Tell if a parameter is bound again to nothing but the value of a `yield`, which is an observation."""
    yielded = {
        id(target)
        for node in file.nodes_of(function)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Yield)
        for target in node.targets
    }
    for node in file.nodes_of(function):
        is_scope = _is_inner(node, function) or isinstance(
            node, ast.ListComp | ast.SetComp | ast.GeneratorExp
        )
        if is_scope and any(name in names_bound_by(part) for part in file.nodes_of(node)):
            return False
        is_parameter = isinstance(node, ast.arg)
        if name in names_bound_by(node) and not is_parameter and id(node) not in yielded:
            return False
    return True


def _is_inner(node: ast.AST, function: ast.FunctionDef) -> bool:
    return isinstance(node, ast.FunctionDef | ast.Lambda) and node is not function
