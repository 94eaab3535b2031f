"""Claims about what skill code reaches for, by reading it: nothing is imported, nothing runs.

Every action kind that a skill asks for by name is in its envelope, and the code imports nothing that
could act or listen by itself.  This finds the mistakes and the plain lies.  Code that hides what it
does (an action kind computed at run time, a builtin reached through another object) is for the gate,
which decides every action, and for isolation; here such an action kind is noted, not refused.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

from aeros.spec.diagnostics import Diagnostic, Label, Severity, did_you_mean
from aeros.spec.model import Ecm, Skill
from aeros.spec.obligations.obligation import Settled
from aeros.spec.source import Source, Span

HARMLESS = frozenset(
    [
        "__future__",
        "aeros.skill",
        "bisect",
        "cmath",
        "collections",
        "collections.abc",
        "dataclasses",
        "decimal",
        "enum",
        "fractions",
        "functools",
        "heapq",
        "itertools",
        "math",
        "numbers",
        "operator",
        "statistics",
        "string",
        "typing",
    ]
)
"""Modules that compute and do nothing else."""

FORBIDDEN = frozenset(
    ("__builtins__", "__import__", "breakpoint", "compile", "eval", "exec", "globals", "input", "open")
)
"""Builtins that reach outside the skill or run other code."""


def skill_code_obligations(ecm: Ecm, code: Mapping[str, bytes]) -> Iterator[Settled]:
    """Every claim about the code of `ecm`; code that does not parse is left to `entry_points`.

    code: the module's Python files by path relative to its folder.
    """
    files = {path: file for path, content in code.items() if (file := _read(ecm, path, content)) is not None}
    for path, file in files.items():
        yield Settled(f"form/code/{path}/reach", _reach(ecm, file))
    for skill in ecm.skills.values():
        file = files.get(f"{skill.module_name}.py")
        if file is not None:
            yield Settled(f"form/{skill.id}/asks", _asks(skill, file))


class _File:
    """One file of skill code: its text, its syntax tree, its functions by name."""

    def __init__(self, source: Source, tree: ast.Module) -> None:
        self.source = source
        self.tree = tree
        self.functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        self._starts = [source.line_start(line) for line in range(1, source.line_count + 1)]

    def span(self, node: ast.expr | ast.stmt) -> Span:
        """Where `node` begins, to the end of that line at most."""
        line = self.source.line_text(node.lineno)
        column = len(line.encode()[: node.col_offset].decode(errors="ignore"))
        start = self._starts[node.lineno - 1] + column
        same_line = node.end_lineno == node.lineno and node.end_col_offset is not None
        length = (
            node.end_col_offset - node.col_offset if same_line and node.end_col_offset else len(line) - column
        )
        return self.source.span(start, min(start + max(length, 1), len(self.source.text)))


def _read(ecm: Ecm, path: str, content: bytes) -> _File | None:
    try:
        text = content.decode("utf-8")
        return _File(Source(str(Path(ecm.folder) / path), text), ast.parse(text))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _reach(ecm: Ecm, file: _File) -> Diagnostic | None:
    """The first import or builtin through which the code could act by itself."""
    for node in ast.walk(file.tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = ["." * node.level + (node.module or "")]
        elif isinstance(node, ast.Name) and node.id in FORBIDDEN:
            return _refused(file, node, f"skill code of `{ecm.id}` uses `{node.id}`")
        elif isinstance(node, ast.Attribute) and node.attr.startswith("__") and node.attr.endswith("__"):
            return _refused(file, node, f"skill code of `{ecm.id}` reaches into `{node.attr}`")
        for name in names:
            if name not in HARMLESS and isinstance(node, ast.stmt):
                return _refused(file, node, f"skill code of `{ecm.id}` imports `{name}`")
    return None


def _refused(file: _File, node: ast.expr | ast.stmt, headline: str) -> Diagnostic:
    return Diagnostic(
        "AE134",
        headline,
        Label(file.span(node), "a skill only yields actions and gets observations"),
        help=(
            "import `aeros.skill` and what computes, such as `math`; ask for everything else as an action",
        ),
    )


def _asks(skill: Skill, file: _File) -> Diagnostic | None:
    """The first action that the skill's code asks for and its envelope does not hold."""
    unclear: Diagnostic | None = None
    for call in _act_calls(skill.function, file):
        kind = call.args[0] if call.args else None
        if not (isinstance(kind, ast.Constant) and isinstance(kind.value, str)):
            unclear = Diagnostic(
                "AE133",
                f"`{skill.id}` asks for an action kind that is only known at run time: the gate will decide",
                Label(file.span(call)),
                severity=Severity.NOTE,
            )
        elif kind.value not in skill.envelope:
            near = did_you_mean(kind.value, skill.envelope)
            help_ = f"did you mean `{near}`?" if near else f"declare `{kind.value}` in its `envelope`"
            return Diagnostic(
                "AE133",
                f"`{skill.id}` asks for `{kind.value}`, which its envelope does not hold",
                Label(file.span(kind), "asked for here"),
                (Label(skill.span, "declared here"),),
                help=(help_,),
            )
    return unclear


def _act_calls(function: str, file: _File) -> Iterator[ast.Call]:
    """Every call of `act` in `function` and in the functions of the file that it leads to."""
    seen: set[str] = set()
    pending = [function]
    while pending:
        name = pending.pop()
        if name in seen or name not in file.functions:
            continue
        seen.add(name)
        for node in ast.walk(file.functions[name]):
            if isinstance(node, ast.Name):
                pending.append(node.id)
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "act":
                yield node
