"""Docstrings of the code: a first line that names or commands, and sections that say what goes in and out.

Public functions have Args, and Returns or Yields; public records describe each field. Every function that
has a docstring lists in Raises what its own `raise` statements raise.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

from tests.repo.tree import PYTHON, text_of

_QUESTION: Final = re.compile(
    r"(What|Whether|How|Why|Which|Where|Who|Whom|Whose|When|Whoever|Whatever|See)\b"
)
_NOTHING: Final = frozenset(("None", "Never", "NoReturn", "Iterator[None]", "Generator[None]"))
"""Annotations of functions that give nothing to their caller, context managers included."""

_RECORDS: Final = frozenset(("NamedTuple", "TypedDict", "Struct"))
"""Bases that make a class a record, besides the decorator `dataclass`."""

_ENTRY: Final = re.compile(r"^ {4}(\*{0,2}[\w.]+(?:, [\w.]+)*)(?: \([^)]*\))?: *\S", re.MULTILINE)

Function = ast.FunctionDef | ast.AsyncFunctionDef


def _public(body: list[ast.stmt], prefix: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Yield the public functions and classes of a module, and the public methods of its public classes."""
    for node in body:
        if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from _public(node.body, f"{prefix}{node.name}.")


def _problems(path: Path, tree: ast.Module) -> Iterator[str]:
    if _QUESTION.match(ast.get_docstring(tree) or ""):
        yield f"{path} (module): starts with a question word"
    for name, node in _public(tree.body):
        assert isinstance(node, Function | ast.ClassDef)
        docstring = ast.get_docstring(node)
        if docstring is None:
            if "override" not in _decorators(node):
                yield f"{path} {name}: no docstring"
            continue
        if _QUESTION.match(docstring):
            yield f"{path} {name}: starts with a question word"
        if isinstance(node, Function):
            missing = _missing_sections(node, docstring)
        else:
            missing = _missing_fields(node, docstring)
        yield from (f"{path} {name}: {problem}" for problem in missing)
    for node in ast.walk(tree):
        if isinstance(node, Function):
            yield from (f"{path} {node.name}: {problem}" for problem in _missing_exceptions(node))


def _decorators(node: Function | ast.ClassDef) -> set[str]:
    return {ast.unparse(one).split("(")[0].split(".")[-1] for one in node.decorator_list}


def _section(docstring: str, title: str) -> str:
    """Return the indented lines below a title."""
    found = re.search(rf"^{title}:\n((?: {{4}}.*\n|\n(?= {{4}}))*)", docstring + "\n", re.MULTILINE)
    return found[1] if found else ""


def _entries(text: str) -> set[str]:
    """Return the names that a section describes, without modules."""
    found = (name for names in _ENTRY.findall(text) for name in names.split(","))
    return {name.strip("* ").split(".")[-1] for name in found}


def _missing_sections(node: Function, docstring: str) -> Iterator[str]:
    decorators = _decorators(node)
    if "override" in decorators or docstring.startswith("Implement"):
        return  # the port says it
    given = [
        *node.args.posonlyargs,
        *node.args.args,
        *node.args.kwonlyargs,
        node.args.vararg,
        node.args.kwarg,
    ]
    names = [
        one.arg for one in given if one is not None and one.arg not in {"self", "cls"} and one.arg.strip("_")
    ]
    described = _entries(_section(docstring, "Args"))
    missing = [name for name in names if name not in described]
    if missing:
        yield f"Args does not describe {', '.join(missing)}"
    returned = "" if node.returns is None else ast.unparse(node.returns)
    is_property = bool(decorators & {"property", "cached_property"})  # its first line is of the value
    if (
        returned not in _NOTHING
        and not is_property
        and not (_section(docstring, "Returns") or _section(docstring, "Yields")).strip()
    ):
        yield "no Returns"


@cache
def _trees() -> dict[Path, ast.Module]:
    return {path: ast.parse(text_of(path)) for path in PYTHON}


@cache
def _record_bases() -> frozenset[str]:
    """Return the names of classes whose subclasses are records, of libraries and of our own."""
    bases_of = {
        node.name: {ast.unparse(base).split("[")[0].split(".")[-1] for base in node.bases}
        for tree in _trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }
    found = set(_RECORDS)
    while more := {name for name, bases in bases_of.items() if bases & found} - found:
        found |= more
    return frozenset(found)


def _missing_fields(node: ast.ClassDef, docstring: str) -> Iterator[str]:
    bases = {ast.unparse(base).split("[")[0].split(".")[-1] for base in node.bases}
    if "dataclass" not in _decorators(node) and not bases & _record_bases():
        return
    described = _entries(_section(docstring, "Attributes"))
    fields = [
        one.target.id
        for one in node.body
        if isinstance(one, ast.AnnAssign)
        and isinstance(one.target, ast.Name)
        and not one.target.id.startswith("_")
        and "ClassVar" not in ast.unparse(one.annotation)
        and not _has_doc(one.value)
    ]
    missing = [name for name in fields if name not in described]
    if missing:
        yield f"Attributes does not describe {', '.join(missing)}"


def _has_doc(default: ast.expr | None) -> bool:
    """Check for `field(metadata={"doc": …})`, from which schemas and messages take the description."""
    for keyword in default.keywords if isinstance(default, ast.Call) else ():
        if keyword.arg == "metadata" and isinstance(keyword.value, ast.Dict):
            return any(isinstance(key, ast.Constant) and key.value == "doc" for key in keyword.value.keys)
    return False


def _missing_exceptions(node: Function) -> Iterator[str]:
    docstring = ast.get_docstring(node)
    if docstring is None:
        return
    described = _entries(_section(docstring, "Raises"))
    for name in sorted(_raised(node.body)):
        if described.isdisjoint({name, *_builtin_bases(name)}):
            yield f"Raises does not describe {name}"


def _raised(body: list[ast.stmt]) -> set[str]:
    """Return the names of exception classes that the statements raise, functions inside them excepted."""
    found: set[str] = set()
    pending: list[ast.AST] = list(body)
    while pending:
        node = pending.pop()
        if isinstance(node, Function | ast.ClassDef | ast.Lambda):
            continue
        pending += ast.iter_child_nodes(node)
        if isinstance(node, ast.Raise) and node.exc is not None:
            thrown = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            name = ast.unparse(thrown).split(".")[-1]
            if name.strip("_")[:1].isupper():
                found.add(name)
    return found


def _builtin_bases(name: str) -> set[str]:
    kind = getattr(builtins, name, None)
    return {one.__name__ for one in kind.__mro__[:-2]} if isinstance(kind, type) else set()


def test_docstrings_say_what_code_takes_gives_and_raises() -> None:
    assert sorted(problem for path, tree in _trees().items() for problem in _problems(path, tree)) == []


def _found_in(code: str) -> list[str]:
    tree = ast.parse(code)
    return [one.split(": ", 1)[1] for one in _problems(Path("x.py"), tree)]


def test_a_field_a_result_and_an_exception_that_are_not_described_are_found() -> None:
    record = '@dataclass\nclass A:\n    """A record.\n\n    Attributes:\n        a, b: m.\n    """\n\n    '
    assert _found_in(record + "a: int\n    b: int") == []
    assert _found_in(record + "a: int\n    c: int = field(default=1)") == ["Attributes does not describe c"]
    assert _found_in(record + 'c: int = field(metadata={"doc": "m"})') == []
    assert _found_in('class A(NamedTuple):\n    """A tuple."""\n    a: int') == [
        "Attributes does not describe a"
    ]
    assert _found_in('def f() -> bool:\n    """Return True if so."""') == ["no Returns"]
    assert _found_in('def f() -> bool:\n    """Check.\n\n    Returns:\n        True.\n    """') == []
    assert _found_in('def f() -> bool:\n    """Check.\n\n    Returns:\n    """') == ["no Returns"]
    assert _found_in("def f() -> None: ...") == ["no docstring"]
    assert _found_in('def _f() -> None:\n    """Do it."""\n    raise AuditError("no")') == [
        "Raises does not describe AuditError"
    ]
    opened = 'def _f() -> None:\n    """Do it.\n\n    Raises:\n        OSError: no.\n    """\n    '
    assert _found_in(opened + "raise IsADirectoryError") == []
    assert _found_in(opened + "raise ValueError") == ["Raises does not describe ValueError"]
