"""Calls by which a skill asks for actions, followed from its function through the files of its module."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Final

from aeros.spec.obligations.skill_syntax.bound_names import parts_in_same_scope
from aeros.spec.obligations.skill_syntax.neighbours import ModuleFiles, files_run_by, neighbour_imports
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile

ACTION_NAMES: Final = ("act", "Action")
"""Names of the interface of skills that make an action."""


def action_calls(path: str, function: str, files: ModuleFiles) -> Iterator[tuple[SkillFile, ast.Call]]:
    """Yield every call of `act` or `Action` that a skill may reach.

    These are in its function, in the functions that it leads to, and everywhere outside of functions in the
    files that are executed for it.  Defaults, annotations and decorators of a function are outside of it:
    they run when the file is loaded.

    Args:
        path: path of the file with its function.
        function: name of its function.
        files: the module's files.

    Yields:
        The file of each call, and the call.
    """
    executed = files_run_by(path, files)
    places = {one: _functions_known_to(one, executed) for one in executed}
    seen: set[tuple[str, str]] = set()
    pending: list[tuple[str, ast.AST]] = []
    for one, file in executed.items():
        for statement in file.tree.body:
            is_function = isinstance(statement, ast.FunctionDef)
            outside = parts_in_same_scope(statement) if is_function else [statement]
            pending += [(one, part) for part in outside]
    if function in executed[path].functions:
        pending.append((path, executed[path].functions[function]))
    while pending:
        here, part = pending.pop()
        for node in executed[here].nodes_of(part):
            place = places[here].get(node.id) if isinstance(node, ast.Name) else None
            if place is not None and place not in seen:
                seen.add(place)
                pending.append((place[0], executed[place[0]].functions[place[1]]))
            elif isinstance(node, ast.Call) and is_action_call(node):
                yield executed[here], node


def is_action_call(node: ast.Call) -> bool:
    """Tell if a call makes an action.

    Args:
        node: a call in skill code.

    Returns:
        True if it calls `act` or `Action`.
    """
    return isinstance(node.func, ast.Name) and node.func.id in ACTION_NAMES


def written_parameters(call: ast.Call) -> tuple[str, ...] | None:
    """Return the names of an action's parameters.

    Args:
        call: call of `act` or `Action`.

    Returns:
        The names; None if they are not written out.
    """
    if isinstance(call.func, ast.Name) and call.func.id == "act":
        named = [one.arg for one in call.keywords if one.arg is not None]
        return tuple(named) if len(call.args) == 1 and len(named) == len(call.keywords) else None
    parameters = call.args[1] if len(call.args) == 2 and not call.keywords else None
    if not isinstance(parameters, ast.Dict):
        return None
    keys = [
        key.value for key in parameters.keys if isinstance(key, ast.Constant) and isinstance(key.value, str)
    ]
    return tuple(keys) if len(keys) == len(parameters.keys) else None


def _functions_known_to(path: str, files: ModuleFiles) -> dict[str, tuple[str, str]]:
    """Return the file and the name of each function that a file knows, by its name there."""
    known = {name: (path, name) for name in files[path].functions}
    for one in neighbour_imports(files[path].tree):
        if one.path in files and one.alias.name in files[one.path].functions:
            known[one.local_name] = (one.path, one.alias.name)
    return known
