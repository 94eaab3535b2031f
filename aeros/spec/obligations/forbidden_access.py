"""Detection of code that reaches outside a skill: imports, builtins and attributes, found by reading it."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Sequence
from functools import cache
from types import ModuleType

_SKILL_NAMES = frozenset(("Action", "Inputs", "Observation", "SkillBody", "act"))

ALLOWED_MODULES = frozenset(
    (
        "__future__",
        "bisect",
        "cmath",
        "collections.abc",
        "dataclasses",
        "decimal",
        "enum",
        "fractions",
        "functools",
        "heapq",
        "itertools",
        "math",
        "statistics",
        "typing",
    )
)
"""Standard modules whose public names only compute, except those in `_FORBIDDEN_NAMES`."""

_FORBIDDEN_NAMES = frozenset(
    ("ForwardRef", "evaluate_forward_ref", "get_type_hints", "make_dataclass", "singledispatch")
)

FORBIDDEN = frozenset(
    (
        "__builtins__",
        "__import__",
        "__loader__",
        "__spec__",
        "breakpoint",
        "compile",
        "delattr",
        "dir",
        "eval",
        "exec",
        "exit",
        "getattr",
        "globals",
        "help",
        "input",
        "locals",
        "memoryview",
        "open",
        "print",
        "quit",
        "setattr",
        "vars",
    )
)
"""Builtins that reach outside the skill, run other code, or touch attributes by computed names."""

_INTROSPECTION_ATTRIBUTES = ("ag_", "co_", "cr_", "f_", "func_", "gi_", "im_", "tb_")
"""Prefixes of the attributes that expose the internals of frames, code and generators."""


def first_forbidden_access(nodes: Sequence[ast.AST]) -> tuple[ast.expr | ast.stmt, str] | None:
    """Find the first place in skill code that reaches outside the skill.

    Args:
        nodes: nodes of the code's syntax tree, in order.

    Returns:
        The node and a description that completes “skill code …”; None if there is no such place.
    """
    modules = _imported_modules(nodes)
    member_accesses = {
        id(node.value)
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules
    }
    for node in nodes:
        description: str | None = None
        if isinstance(node, ast.Import | ast.ImportFrom):
            description = _forbidden_import(node)
        elif isinstance(node, ast.Name) and node.id in FORBIDDEN:
            description = f"uses `{node.id}`"
        elif isinstance(node, ast.Name) and node.id in modules and id(node) not in member_accesses:
            description = f"passes the module `{node.id}` around"
        elif isinstance(node, ast.Attribute):
            description = _forbidden_attribute(node, modules)
        elif isinstance(node, ast.AsyncFunctionDef | ast.Await | ast.Global | ast.Nonlocal):
            description = "keeps or awaits something between actions"
        if description is not None and isinstance(node, ast.expr | ast.stmt):
            return node, description
    return None


def _imported_modules(nodes: Sequence[ast.AST]) -> dict[str, str]:
    """Return the modules that are imported as a whole, by the name they are bound to."""
    return {
        alias.asname or alias.name: alias.name
        for node in nodes
        if isinstance(node, ast.Import)
        for alias in node.names
    }


def _forbidden_import(node: ast.Import | ast.ImportFrom) -> str | None:
    if isinstance(node, ast.Import):
        # `import a.b` binds `a`, which gives access to every other module in it.
        refused = [one.name for one in node.names if one.name not in ALLOWED_MODULES or "." in one.name]
        return f"imports `{refused[0]}`" if refused else None
    module = "." * node.level + (node.module or "")
    if module == "aeros.skill":
        refused = [one.name for one in node.names if one.name not in _SKILL_NAMES]
    elif module in ALLOWED_MODULES:
        refused = [one.name for one in node.names if one.name not in _public_names(module)]
    else:
        return f"imports `{module}`"
    return f"imports `{refused[0]}` from `{module}`" if refused else None


def _forbidden_attribute(node: ast.Attribute, modules: dict[str, str]) -> str | None:
    if node.attr.startswith("__") or node.attr.startswith(_INTROSPECTION_ATTRIBUTES):
        return f"reaches into `{node.attr}`"
    if isinstance(node.value, ast.Name) and node.value.id in modules:
        module = modules[node.value.id]
        if module in ALLOWED_MODULES and node.attr not in _public_names(module):
            return f"uses `{node.attr}` of `{module}`"
    return None


@cache
def _public_names(module: str) -> frozenset[str]:
    """Return the public names of an allowed standard module, without modules and forbidden names."""
    found = importlib.import_module(module)
    return frozenset(
        name
        for name, value in vars(found).items()
        if not name.startswith("_") and not isinstance(value, ModuleType) and name not in _FORBIDDEN_NAMES
    )
