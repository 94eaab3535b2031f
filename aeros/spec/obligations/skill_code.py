"""Claims about the actions and the imports of skill code, settled by reading it: nothing is imported or run.

Every action that a skill asks for is of a kind in its envelope and has that kind's parameters.  The code
imports nothing, and uses no builtin or attribute, through which it could act or listen by itself.  This finds
mistakes and simple lies.  It is no sandbox: Python has more ways out than a reader can list.  The gate keeps
code in and, for code that is not trusted, isolation.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.forbidden_access import first_forbidden_access
from aeros.spec.obligations.skill_source import SkillFile, UnreadableCodeError
from aeros.spec.obligations.verdicts import StaticClaim

_ACTION_NAMES = ("act", "Action")


def skill_code_obligations(
    ecm: Ecm, site: Site, files: Mapping[str, SkillFile | UnreadableCodeError]
) -> Iterator[StaticClaim]:
    """Make every claim about the code of a module.

    Args:
        ecm: the module.
        site: site that declares the action kinds.
        files: the module's Python files by path relative to its folder.

    Yields:
        The claims, settled.
    """
    for path, file in files.items():
        if isinstance(file, UnreadableCodeError):
            name, help_ = Path(ecm.folder) / path, ("write it as plain UTF-8",)
            yield StaticClaim(
                ClaimForm.CODE_REACHES_NOTHING(path),
                Diagnostic("AE134", f"`{name}` is not plain Python: {file}", help=help_),
            )
            continue
        yield StaticClaim(ClaimForm.CODE_REACHES_NOTHING(path), _no_forbidden_access(ecm, file))
        yield StaticClaim(ClaimForm.CODE_ASKS_PLAINLY(path), _action_calls_are_readable(file))
        for skill in ecm.skills.values():
            if path == f"{skill.module_name}.py":
                yield StaticClaim(
                    ClaimForm.SKILL_ASKS_WITHIN_ENVELOPE(skill.id),
                    _requests_within_envelope(skill, site, file),
                )


def _no_forbidden_access(ecm: Ecm, file: SkillFile) -> Diagnostic | None:
    """Report the first import, builtin or attribute through which the code could act by itself."""
    access = first_forbidden_access(file.nodes)
    if access is None:
        return None
    node, description = access
    return Diagnostic(
        "AE134",
        f"skill code of `{ecm.id}` {description}",
        SpanLabel(file.span(node), "a skill only yields actions and receives observations"),
        help=("import only from `aeros.skill` and modules such as `math`; yield actions for the rest",),
    )


def _action_calls_are_readable(file: SkillFile) -> Diagnostic | None:
    """Check that every requested action can be read from the code.

    `act` and `Action` are only called or used in annotations, and no function is bound twice.
    """
    called = {id(node.func) for node in file.nodes if isinstance(node, ast.Call)}
    annotations = {id(part) for hint in _annotations(file) for part in ast.walk(hint)}
    for node in file.nodes:
        if isinstance(node, ast.Name) and node.id == "act" and id(node) not in called | annotations:
            return _unreadable_call(file, node, "`act` is used other than in a call")
        if isinstance(node, ast.ImportFrom) and node.module == "aeros.skill":
            renamed = [alias.name for alias in node.names if alias.asname not in (None, alias.name)]
            if renamed:
                return _unreadable_call(file, node, f"`{renamed[0]}` is imported under another name")
    bound: set[str] = set(_ACTION_NAMES)
    for statement in file.tree.body:
        for name in _bound_names(statement):
            if name in bound:
                return _unreadable_call(file, statement, f"`{name}` is bound a second time")
            bound.add(name)
    return None


def _annotations(file: SkillFile) -> Iterator[ast.expr]:
    for node in file.nodes:
        if isinstance(node, ast.FunctionDef) and node.returns is not None:
            yield node.returns
        elif isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
            yield node.annotation


def _bound_names(statement: ast.stmt) -> Iterator[str]:
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield statement.name
    elif not isinstance(statement, ast.Import | ast.ImportFrom):
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield node.id


def _unreadable_call(file: SkillFile, node: ast.expr | ast.stmt, what: str) -> Diagnostic:
    return Diagnostic(
        "AE133",
        f"the actions that this code asks for cannot be determined: {what}",
        SpanLabel(file.span(node)),
        help=("call `act(KIND, ...)` directly, and bind every name once",),
    )


def _requests_within_envelope(skill: Skill, site: Site, file: SkillFile) -> Diagnostic | None:
    """Report the first action that the skill's code asks for and its envelope does not hold."""
    for call in _act_calls(skill.function, file):
        kind = call.args[0] if call.args else None
        if not (isinstance(kind, ast.Constant) and isinstance(kind.value, str)):
            return _unreadable_call(file, call, "the kind of an action is not written out")
        if kind.value not in skill.envelope:
            near = did_you_mean(kind.value, skill.envelope)
            help_ = f"did you mean `{near}`?" if near else f"declare `{kind.value}` in its `envelope`"
            return Diagnostic(
                "AE133",
                f"`{skill.id}` asks for `{kind.value}`, which is not in its envelope",
                SpanLabel(file.span(kind), "asked for here"),
                (SpanLabel(skill.span, "declared here"),),
                help=(help_,),
            )
        declared = site.kinds[kind.value].parameters
        unknown = [one.arg for one in call.keywords if one.arg is not None and one.arg not in declared]
        if unknown and isinstance(call.func, ast.Name) and call.func.id == "act":
            near = did_you_mean(unknown[0], declared)
            help_ = f"did you mean `{near}`?" if near else f"it has {', '.join(declared) or 'none'}"
            headline = f"`{kind.value}` has no parameter `{unknown[0]}`"
            return Diagnostic("AE133", headline, SpanLabel(file.span(call)), help=(help_,))
    return None


def _act_calls(function: str, file: SkillFile) -> Iterator[ast.Call]:
    """Yield every call of `act` or `Action` that the skill may reach.

    These are in its function, in the functions that it leads to, and everywhere outside of functions.
    """
    seen: set[str] = set()
    pending: list[ast.AST] = [node for node in file.tree.body if not isinstance(node, ast.FunctionDef)]
    pending += [file.functions[function]] if function in file.functions else []
    while pending:
        for node in ast.walk(pending.pop()):
            if isinstance(node, ast.Name) and node.id in file.functions and node.id not in seen:
                seen.add(node.id)
                pending.append(file.functions[node.id])
            elif (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id in _ACTION_NAMES
            ):
                yield node
