"""Allow-list of the Python that skills and perceivers are written in.

Every node of the syntax tree is of a listed class, stands where that class may stand, and uses listed names.
Anything else is refused, so a door that nobody thought of is closed.  What is allowed computes with plain
values, and makes functions, dataclasses and enumerations.  It cannot reach an attribute by a computed name,
run text as code, or change an object that other code shares.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from types import MappingProxyType
from typing import Final

from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.obligations.skill_syntax import allowed_names as names
from aeros.spec.obligations.skill_syntax.bound_names import bound_names, identifiers, names_bound_by
from aeros.spec.obligations.skill_syntax.neighbours import (
    ModuleFiles,
    defined_classes,
    imported_classes,
    is_neighbour_import,
)
from aeros.spec.obligations.skill_syntax.skill_source import Located


class CodeScope(Enum):
    """Part of a file in which a node stands."""

    MODULE = "at the top of a file"
    CLASS = "in a class"
    FUNCTION = "in a function"


_EVERYWHERE: Final = frozenset(CodeScope)
_IN_FUNCTIONS: Final = frozenset((CodeScope.FUNCTION,))
_AT_THE_TOP: Final = frozenset((CodeScope.MODULE,))

_PLAIN_NODES: Final = (
    # operators and contexts
    "Add And BitAnd BitOr BitXor Div Eq FloorDiv Gt GtE In Invert Is IsNot LShift Load Lt LtE MatMult "
    "Mod Mult Not NotEq NotIn Or Pow RShift Store Sub UAdd USub Del "
    # expressions
    "Attribute BinOp BoolOp Call Compare Constant Dict DictComp FormattedValue GeneratorExp IfExp "
    "JoinedStr Lambda List ListComp Name Set SetComp Slice Starred Subscript Tuple UnaryOp "
    # parts of statements and expressions
    "Module alias arg arguments comprehension keyword "
    # statements
    "AnnAssign Assign Expr FunctionDef Pass"
)
_FUNCTION_NODES: Final = (
    "Assert AugAssign Break Continue Delete ExceptHandler For If MatchAs MatchClass MatchMapping "
    "MatchOr MatchSequence MatchSingleton MatchStar MatchValue Match NamedExpr Raise Return Try While "
    "Yield YieldFrom match_case"
)
ALLOWED_NODES: Final[Mapping[str, frozenset[CodeScope]]] = {
    **dict.fromkeys(_PLAIN_NODES.split(), _EVERYWHERE),
    **dict.fromkeys(_FUNCTION_NODES.split(), _IN_FUNCTIONS),
    **dict.fromkeys(("ClassDef", "Import", "ImportFrom"), _AT_THE_TOP),
}
"""Classes of nodes that skill code may hold, by name, and where."""

REFUSED_NODES: Final[Mapping[str, tuple[str, str]]] = {
    "AsyncFor": ("awaits something between actions", "write a plain `for`"),
    "AsyncFunctionDef": ("awaits something between actions", "write a plain `def` and `yield` actions"),
    "AsyncWith": ("awaits something between actions", "yield actions instead"),
    "Await": ("awaits something between actions", "`yield` an action and receive the observation after it"),
    "Global": (
        "keeps something between actions with `global`",
        "pass the value as an argument and return it",
    ),
    "Nonlocal": (
        "keeps something between actions with `nonlocal`",
        "pass the value as an argument and return it",
    ),
    "Interpolation": ("uses a template string", "write an f-string"),
    "TemplateStr": ("uses a template string", "write an f-string"),
    "ParamSpec": ("declares a type parameter", "annotate with `Any`"),
    "TypeAlias": ("uses a `type` statement", "write `Name = type`"),
    "TypeVar": ("declares a type parameter", "annotate with `Any`"),
    "TypeVarTuple": ("declares a type parameter", "annotate with `Any`"),
    "TryStar": ("uses `except*`", "write `except`"),
    "With": ("uses `with`", "call functions directly: there is nothing to open or close"),
    "withitem": ("uses `with`", "call functions directly: there is nothing to open or close"),
}
"""Classes of nodes that are refused wherever they stand: what they do, and what to write instead."""

# Not `_`, which an interactive Python session adds to the builtins.
_FORBIDDEN_BUILTINS: Final = (
    frozenset(dir(builtins)) - names.ALLOWED_BUILTINS - {"False", "None", "True", "_"}
)

_TOP_HELP: Final = (
    "at its top a file has imports, constants, functions and classes; put the rest into a function"
)
_DATACLASS_HELP: Final = (
    "write `@dataclass(frozen=True)` with fields such as `x: float = 0.0`, and functions on it"
)


_ENUMERATION_HELP: Final = "write a member such as `OPEN = 1`"

_NEIGHBOUR_HELP: Final = "import names of a file beside this one, as in `from .pieces import find_plate`"


@dataclass(frozen=True)
class Refusal:
    """Place in skill code that is not on the allow-list.

    Attributes:
        node: the place.
        description: phrase that completes “skill code …”.
        help: what to write instead.
    """

    node: Located
    description: str
    help: str


def first_refusal(
    tree: ast.Module,
    allowed: names.AllowedNames = names.SKILL_NAMES,
    imported: ModuleFiles = MappingProxyType({}),
) -> Refusal | None:
    """Find the first place in a file of module code that is not allowed.

    Args:
        tree: syntax tree of the file.
        allowed: names that this kind of code may use.
        imported: other files of the module that it imports, directly or not.

    Returns:
        The place nearest to the beginning of the file; None if all of it is allowed.
    """
    return min(
        _Reading(tree, allowed, imported).refusals(),
        key=lambda one: (one.node.lineno, one.node.col_offset),
        default=None,
    )


class _Reading:
    """One reading of a file: what its names stand for, and what in it is refused."""

    def __init__(self, tree: ast.Module, allowed: names.AllowedNames, imported: ModuleFiles) -> None:
        self._tree = tree
        self._allowed = allowed
        self._imported = imported
        self._classes = {node.name for node in defined_classes(tree)} | imported_classes(tree, imported)
        self._placed: set[int] = set()  # restricted members that stand where they may
        for node in defined_classes(tree):
            self._place_in_class(node)

    @cached_property
    def _origins(self) -> Mapping[str, str]:
        """Module, or `module.member`, that each imported name stands for."""
        found: dict[str, str] = {}
        for node in self._tree.body:
            if isinstance(node, ast.Import):
                found |= {one.asname or one.name: one.name for one in node.names}
            elif isinstance(node, ast.ImportFrom):
                module = _module_name(node)
                found |= {one.asname or one.name: f"{module}.{one.name}" for one in node.names}
        return found

    @cached_property
    def _known_names(self) -> frozenset[str]:
        return names.ALLOWED_BUILTINS | frozenset(bound_names(self._tree, nested=True))

    @cached_property
    def _own_members(self) -> frozenset[str]:
        """Names of the members of the classes of the file and of those that it imports."""
        trees = (self._tree, *(file.tree for file in self._imported.values()))
        classes = (node for tree in trees for node in defined_classes(tree))
        return frozenset(name for one in classes for part in one.body for name in bound_names(part))

    def _origin(self, node: ast.expr) -> str | None:
        """Return the `module.member` or the builtin that an expression stands for."""
        if isinstance(node, ast.Name):
            return self._origins.get(node.id, node.id)
        if isinstance(node, ast.Attribute):
            module = self._module(node.value)
            return None if module is None else f"{module}.{node.attr}"
        return None

    def _module(self, node: ast.expr) -> str | None:
        """Return the allowed module that an expression stands for, as `np` or `np.linalg`."""
        if isinstance(node, ast.Name):
            module = self._origins.get(node.id)
        elif isinstance(node, ast.Attribute):
            module = f"{self._module(node.value)}.{node.attr}"
        else:
            return None
        return module if module in self._allowed.modules else None

    def _place_in_class(self, node: ast.ClassDef) -> None:
        """Mark the members of `node` that may only be a base, a decorator or the value of a field."""
        self._placed |= {id(base) for base in node.bases if self._origin(base) in names.BASE_CLASSES}
        for decorator in node.decorator_list:
            called = decorator.func if isinstance(decorator, ast.Call) else decorator
            if self._origin(called) in names.CLASS_DECORATORS:
                self._placed.add(id(called))
        for part in node.body:
            value = part.value if isinstance(part, ast.AnnAssign) else None
            if isinstance(value, ast.Call) and self._origin(value.func) == "dataclasses.field":
                self._placed.add(id(value.func))

    def refusals(self) -> Iterator[Refusal]:
        """Yield every refused place, in no order."""
        pending: list[tuple[ast.AST, CodeScope, Located | None]] = [(self._tree, CodeScope.MODULE, None)]
        while pending:
            node, scope, place = pending.pop()
            place = node if isinstance(node, Located) else place
            if place is not None:
                for description, help_ in self._reasons(node, scope):
                    yield Refusal(place, description, help_)
            if isinstance(node, ast.FunctionDef):
                allowed = names.METHOD_DECORATORS if scope is CodeScope.CLASS else names.FUNCTION_DECORATORS
                yield from self._decorator_refusals(node, allowed)
            elif isinstance(node, ast.ClassDef):
                yield from self._decorator_refusals(node, names.CLASS_DECORATORS)
                yield from self._class_refusals(node)
            inner = _body_scope(node)
            for field, value in ast.iter_fields(node):
                below = inner if inner is not None and field == "body" else scope
                children = value if isinstance(value, list) else [value]
                pending += [(child, below, place) for child in children if isinstance(child, ast.AST)]

    def _reasons(self, node: ast.AST, scope: CodeScope) -> Iterator[tuple[str, str]]:
        kind = type(node).__name__
        if kind in REFUSED_NODES:
            yield REFUSED_NODES[kind]
        elif kind not in ALLOWED_NODES:
            yield f"uses `{kind}`, a form of Python that is not allowed", self._allowed.advice
        elif scope not in ALLOWED_NODES[kind]:
            yield f"uses `{_word(node)}` {scope.value}", _TOP_HELP
        for name in identifiers(node):
            if name.startswith("__"):
                yield (
                    _describe_dunder(node, name),
                    _DATACLASS_HELP if scope is CodeScope.CLASS else self._allowed.advice,
                )
            elif not name.isascii():
                yield f"uses the name `{name}`, which is not ASCII", "write names with the letters a to z"
        for name in names_bound_by(node):
            # Where the name is not bound yet, Python takes the builtin.
            if name in _FORBIDDEN_BUILTINS and not name.startswith("__"):
                yield f"binds `{name}`, the name of a builtin", "choose another name"
        match node:
            case ast.Import() | ast.ImportFrom():
                yield from self._import_reasons(node)
            case ast.Attribute():
                yield from self._attribute_reasons(node)
                yield from self._member_reasons(node)
            case ast.Name(ctx=ast.Load()):
                yield from self._name_reasons(node)
                yield from self._member_reasons(node)
            case ast.MatchClass(kwd_attrs=attributes):
                for attribute in attributes:
                    yield from self._attribute_name_reasons(attribute)
            case ast.ExceptHandler(type=None):
                yield "catches everything with `except:`", "write `except ValueError:` or another exception"
            case ast.Expr() if scope is not CodeScope.FUNCTION and not _is_text(node.value):
                yield f"does something {scope.value}", _TOP_HELP
            case ast.comprehension(is_async=1):
                yield REFUSED_NODES["AsyncFor"]
            case ast.AnnAssign(target=target) if not isinstance(target, ast.Name):
                yield "annotates something other than a name", "annotate a name, as in `x: float = 0.0`"

    def _name_reasons(self, node: ast.Name) -> Iterator[tuple[str, str]]:
        if node.id.startswith("__"):
            return  # told already, as of every name
        if node.id in _FORBIDDEN_BUILTINS:
            yield f"uses `{node.id}`", self._allowed.advice
        elif node.id not in self._known_names:
            near = did_you_mean(node.id, self._known_names)
            yield (
                f"uses `{node.id}`, which it does not define",
                (f"did you mean `{near}`?" if near else "define the name, or import it"),
            )

    def _member_reasons(self, node: ast.Name | ast.Attribute) -> Iterator[tuple[str, str]]:
        """Refuse a module, base class, class decorator or `field` that is used as a value."""
        origin = self._origin(node)
        if self._module(node) is not None:
            if id(node) not in self._placed:
                name = ast.unparse(node)
                yield f"passes the module `{name}` around", f"name a member of it, as `{name}.NAME`"
        elif id(node) in self._placed:
            pass
        elif origin in names.BASE_CLASSES:
            yield (
                f"uses `{ast.unparse(node)}` other than as a base class",
                "write `class NAME(" + ast.unparse(node) + "):`",
            )
        elif origin in names.CLASS_DECORATORS or origin == "dataclasses.field":
            yield f"uses `{ast.unparse(node)}` other than in a class", _DATACLASS_HELP

    def _attribute_reasons(self, node: ast.Attribute) -> Iterator[tuple[str, str]]:
        if not isinstance(node.ctx, ast.Load):
            help_ = "make a new object with `dataclasses.replace`, or keep the value in a variable"
            yield f"changes the attribute `{node.attr}`", help_
        module = self._module(node.value)
        if module is not None:
            self._placed.add(id(node.value))
            if node.attr not in self._allowed.members[module]:
                yield f"uses `{node.attr}` of `{module}`", self._allowed.advice
        else:
            yield from self._attribute_name_reasons(node.attr)

    def _attribute_name_reasons(self, name: str) -> Iterator[tuple[str, str]]:
        if _reaches_further(name):
            if not name.startswith("__"):  # told already, as of every name
                help_ = (
                    "write an f-string" if name.startswith("format") else "read only what the code declares"
                )
                yield f"reaches into `{name}`", help_
        elif name not in self._allowed.attributes and name not in self._own_members:
            near = did_you_mean(name, self._allowed.attributes | self._own_members)
            help_ = f"did you mean `{near}`?" if near else "read attributes of the code's own dataclasses"
            yield f"reads the attribute `{name}`, which no plain value has", help_

    def _import_reasons(self, node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, str]]:
        if isinstance(node, ast.Import):
            # `import a.b` binds `a`, which gives access to every other module in it.
            refused = [
                one.name for one in node.names if one.name not in self._allowed.modules or "." in one.name
            ]
            if refused:
                yield f"imports `{refused[0]}`", self._allowed.advice
            return
        module = _module_name(node)
        if is_neighbour_import(node):
            if any(one.name == "*" for one in node.names):
                yield f"imports everything from `{module}`", _NEIGHBOUR_HELP
            return
        if node.level:
            yield f"imports `{module}`", _NEIGHBOUR_HELP
            return
        if module not in self._allowed.members:
            yield f"imports `{module}`", self._allowed.advice
            return
        members = self._allowed.members[module]
        for one in node.names:
            if one.name not in members:
                near = did_you_mean(one.name, members)
                yield (
                    f"imports `{one.name}` from `{module}`",
                    f"did you mean `{near}`?" if near else self._allowed.advice,
                )

    def _is_member(self, part: ast.stmt) -> bool:
        """Tell if a statement in an enumeration surely makes a member."""
        match part:
            case ast.Assign(value=ast.Call(func=func)) | ast.AnnAssign(value=ast.Call(func=func)):
                return self._origin(func) == "enum.auto"
            case ast.Assign(value=value) | ast.AnnAssign(value=value):
                return isinstance(value, ast.Constant | ast.UnaryOp | ast.BinOp | ast.Tuple)
        return False

    def _decorator_refusals(
        self, node: ast.FunctionDef | ast.ClassDef, allowed: frozenset[str]
    ) -> Iterator[Refusal]:
        for decorator in node.decorator_list:
            called = decorator.func if isinstance(decorator, ast.Call) else decorator
            if self._origin(called) not in allowed:
                known = ", ".join(sorted(one.rpartition(".")[2] for one in allowed))
                description = f"decorates `{node.name}` with `{ast.unparse(called)}`"
                yield Refusal(decorator, description, f"use one of {known}, or none")
            elif isinstance(decorator, ast.Call) and not _is_plain_call(decorator):
                description = f"decorates `{node.name}` with computed options"
                yield Refusal(decorator, description, "write each option as `NAME=True`")

    def _class_refusals(self, node: ast.ClassDef) -> Iterator[Refusal]:
        for base in node.bases:
            is_own = isinstance(base, ast.Name) and base.id in self._classes
            if not is_own and self._origin(base) not in names.BASE_CLASSES:
                yield Refusal(base, f"derives `{node.name}` from `{ast.unparse(base)}`", _DATACLASS_HELP)
        is_enumeration = any((self._origin(base) or "").startswith("enum.") for base in node.bases)
        if is_enumeration and not any(map(self._is_member, node.body)):
            # Called with a name and members, an enumeration without members makes another class.
            yield Refusal(node, f"defines the enumeration `{node.name}` without members", _ENUMERATION_HELP)
        for keyword in node.keywords:
            yield Refusal(keyword, f"gives the class `{node.name}` keywords", _DATACLASS_HELP)
        for part in node.body:
            for name in bound_names(part):
                if _reaches_further(name) and not name.startswith("__"):
                    description = f"gives the class `{node.name}` a member `{name}`"
                    yield Refusal(part, description, "choose another name")


def _module_name(node: ast.ImportFrom) -> str:
    """Return the name of the module as it is written, with its dots: `.math` is a file and no `math`."""
    return "." * node.level + (node.module or "")


def _reaches_further(attribute: str) -> bool:
    return attribute.startswith(names.INTROSPECTION_PREFIXES) or attribute in names.FORBIDDEN_ATTRIBUTES


def _body_scope(node: ast.AST) -> CodeScope | None:
    """Return the scope of a node's `body`, if it is another than that of the node."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
        return CodeScope.FUNCTION
    return CodeScope.CLASS if isinstance(node, ast.ClassDef) else None


def _describe_dunder(node: ast.AST, name: str) -> str:
    is_read = isinstance(node, ast.Attribute | ast.MatchClass)
    is_bound = not is_read and not (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load))
    return f"reaches into `{name}`" if is_read else f"{'binds' if is_bound else 'uses'} `{name}`"


def _word(node: ast.AST) -> str:
    """Return the word by which Python writes a node, as far as it has one."""
    known = {
        "AugAssign": "+=",
        "ClassDef": "class",
        "Delete": "del",
        "ExceptHandler": "except",
        "ImportFrom": "import",
        "NamedExpr": ":=",
        "YieldFrom": "yield from",
    }
    kind = type(node).__name__
    return known.get(kind, kind.lower())


def _is_plain_call(node: ast.Call) -> bool:
    """Check that every argument is a literal under a name."""
    return not node.args and all(
        one.arg is not None and isinstance(one.value, ast.Constant) for one in node.keywords
    )


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)
