"""Generator of docs/reference/api.md: each public name with its docstring, and examples."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from itertools import pairwise
from textwrap import dedent
from types import ModuleType
from typing import Any, NamedTuple

import aeros
import aeros.api
import aeros.perception
from tests.repo.tree import text_of

PUBLIC = tuple(name for name in aeros.__all__ if name != "__version__")
_SECTIONS = ("Args", "Attributes", "Returns", "Yields", "Raises", "Example")
_WIDEST = 88
_FILES_OF_ALIASES = ("aeros/skill.py", "aeros/perception/points.py", "aeros/perception/view.py")
_PORT = "aeros.runtime.ports"
PORT_TYPES = (
    (_PORT, "Readings"),
    (_PORT, "Reading"),
    (_PORT, "Monitor"),
    (_PORT, "PlannedMotion"),
    (_PORT, "Trajectory"),
    (_PORT, "NoMotion"),
    (_PORT, "MotionHandle"),
    (_PORT, "MotionCompletion"),
    ("aeros.sim.conformance.suite", "PlantUnderTest"),
)
"""Module and name of the types that somebody who writes a plant needs besides the public names."""


class Entry(NamedTuple):
    """A public name or a public member of one.

    name: as a program says it, without `aeros`.
    signature: as Python would define it; empty where it is not called.
    """

    name: str
    signature: str
    doc: str


def entries(module: ModuleType = aeros, names: Iterable[str] = PUBLIC) -> Iterator[Entry]:
    """Each of the names, followed by its members, in alphabetical order without regard to case."""
    for name in sorted(names, key=str.lower):
        found = getattr(module, name)
        if inspect.isclass(found):
            yield Entry(name, "", _doc(found))
            yield from _members(name, found)
        elif inspect.isfunction(found):
            yield Entry(name, _signature(found), _doc(found))
        else:
            yield Entry(name, "", _doc_of_alias(name))


def port_page() -> str:
    """The generated part of the page about the types of plants."""
    text = ""
    for module, name in PORT_TYPES:
        found = getattr(import_module(module), name)
        text += f"\n### {module}.{name}\n\n"
        if inspect.isclass(found):
            text += _markdown(_doc(found))
        else:
            definition, doc = _alias(name, f"{module.replace('.', '/')}.py")
            text += f"```text\n{definition}\n```\n\n{_markdown(doc)}"
    return text + "\n"


def perception_page() -> str:
    """The generated part of the page about the toolkit of perceivers."""
    return page(aeros.perception, aeros.perception.__all__)


def page(module: ModuleType = aeros, names: Iterable[str] = PUBLIC) -> str:
    """The generated part of the page about the names of a module."""
    text = ""
    for entry in entries(module, names):
        level = "###" if "." in entry.name else "##"
        text += f"\n{level} {entry.name}\n\n"
        if entry.signature:
            text += f"```text\n{entry.signature}\n```\n\n"
        text += _markdown(entry.doc)
    return text + "\n"


def examples() -> dict[str, str]:
    """The example of each entry that has one."""
    return {one.name: parts["Example"] for one in entries() if "Example" in (parts := _parts(one.doc))}


def _doc(found: Any) -> str:
    return inspect.getdoc(found) or ""


def _alias(name: str, path: str) -> tuple[str, str]:
    """The definition of an alias, and the string below it, which Python does not keep."""
    body = ast.parse(text_of(path)).body
    for assigned, below in pairwise(body):
        if isinstance(assigned, ast.Assign) and ast.unparse(assigned.targets[0]) == name:
            assert isinstance(below, ast.Expr)
            return ast.unparse(assigned), inspect.cleandoc(ast.literal_eval(below.value))
    raise AssertionError(f"{name} is no alias of {path}")


def _doc_of_alias(name: str) -> str:
    """The string below the definition of an alias, in the file that explains it."""
    for path in _FILES_OF_ALIASES:
        if re.search(rf"^{name}\b.* = ", text_of(path), re.MULTILINE):
            return _alias(name, path)[1]
    raise AssertionError(f"{name} is no alias")


def _members(name: str, of: type) -> Iterator[Entry]:
    fields = {*getattr(of, "_fields", ()), *getattr(of, "__dataclass_fields__", ())}
    for member, found in vars(of).items():
        if member.startswith("_") or member in fields:
            continue
        if isinstance(found, property):
            yield Entry(f"{name}.{member}", "", _doc(found))
        elif inspect.isfunction(found):
            yield Entry(f"{name}.{member}", _signature(found), _doc(found))


def _signature(function: Any) -> str:
    node = ast.parse(dedent(inspect.getsource(inspect.unwrap(function)))).body[0]
    assert isinstance(node, ast.FunctionDef)
    node.args.args = [one for one in node.args.args if one.arg != "self"]
    returned = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    if hasattr(function, "__wrapped__"):
        returned = returned.replace("Iterator[", "AbstractContextManager[")
    # By its public name, and with defaults spaced as ruff has them.
    returned = returned.replace("SkillGate", "Gate")
    given = ast.unparse(node.args).replace("=", " = ")
    line = f"{node.name}({given}){returned}"
    if len(line) <= _WIDEST:
        return line
    # At commas outside of brackets and quotes.
    parts, depth, quoted = [""], 0, False
    for character in given:
        quoted ^= character == "'"
        depth += (character in "([{") - (character in ")]}")
        if character == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += character
    return f"{node.name}(\n" + "".join(f"    {one.strip()},\n" for one in parts) + f"){returned}"


def _parts(doc: str) -> dict[str, str]:
    """The text before any section, by the empty name, and each section, dedented."""
    found: dict[str, str] = {"": ""}
    current = ""
    for line in doc.splitlines():
        if line.removesuffix(":") in _SECTIONS and line.endswith(":"):
            current = line.removesuffix(":")
            found[current] = ""
        else:
            found[current] += line + "\n"
    return {name: dedent(text).strip("\n") for name, text in found.items()}


def _markdown(doc: str) -> str:
    parts = _parts(doc)
    text = re.sub(r"^([a-z_]+(?:, [a-z_]+)*): ", r"- `\1`: ", parts.pop(""), flags=re.MULTILINE)
    text = re.sub(r"^    (?=\S)", "  ", text, flags=re.MULTILINE) + "\n\n"
    example = parts.pop("Example", None)
    for name, section in parts.items():
        if name in ("Args", "Attributes", "Raises"):
            section = re.sub(r"^(\w+): ", r"- `\1`: ", section, flags=re.MULTILINE)
            section = re.sub(r"^    ", "  ", section, flags=re.MULTILINE)
            text += f"**{name}**\n\n{section}\n\n"
        else:
            text += f"**{name}**: {section}\n\n"
    if example is not None:
        text += f"```python\n{example}\n```\n\n"
    return text.rstrip("\n") + "\n"
