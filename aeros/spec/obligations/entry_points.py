"""Claims about the entry points of skills, settled by reading the code: nothing is imported or run."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile, UnreadableCodeError
from aeros.spec.obligations.verdicts import StaticClaim

_Function = ast.FunctionDef | ast.AsyncFunctionDef


def entry_point_obligations(
    ecm: Ecm, files: Mapping[str, SkillFile | UnreadableCodeError]
) -> Iterator[StaticClaim]:
    """Claim that every skill's entry point exists and is a generator function of its arguments.

    It takes the observation and the inputs, and the models if the skill declares any.

    Args:
        ecm: the module.
        files: the module's Python files by path relative to its folder.

    Yields:
        A claim for each skill.
    """
    for skill in ecm.skills.values():
        yield StaticClaim(ClaimForm.ENTRY_POINT(skill.id), _entry_point_error(skill, files))


def _entry_point_error(
    skill: Skill, files: Mapping[str, SkillFile | UnreadableCodeError]
) -> Diagnostic | None:
    path, label = f"{skill.module_name}.py", SpanLabel(skill.entry_span)
    file = files.get(path)
    if file is None:
        near = did_you_mean(path, files)
        help_ = (f"did you mean `{near}`?",) if near else ()
        return Diagnostic("AE123", f"there is no `{path}` in this module", label, help=help_)
    if isinstance(file, UnreadableCodeError):
        return Diagnostic("AE123", f"`{path}` is not plain Python: {file}", label)
    functions = _functions(file.tree)
    function = functions.get(skill.function)
    if function is None:
        near = did_you_mean(skill.function, functions)
        help_ = (f"did you mean `{near}`?",) if near else ()
        return Diagnostic("AE123", f"`{path}` has no function `{skill.function}`", label, help=help_)
    if isinstance(function, ast.AsyncFunctionDef) or not _is_generator(function):
        return Diagnostic(
            "AE124",
            f"`{skill.function}` is not a generator, so it could ask for no action",
            label,
            notes=(f"it is defined at line {function.lineno} of `{path}`",),
            help=("`yield act(...)` each action and receive the observation measured after it",),
        )
    if function.decorator_list:
        return Diagnostic(
            "AE124",
            f"`{skill.function}` is decorated, so another function may run in its place",
            label,
            help=("remove the decorator",),
        )
    arguments = function.args
    count, what, more = 2, "the observation and the inputs", ""
    if skill.models:
        count, what, more = 3, "the observation, the inputs and the models", ", models: Models"
    if len(arguments.posonlyargs) + len(arguments.args) != count or arguments.kwonlyargs:
        return Diagnostic(
            "AE124",
            f"`{skill.function}` does not take {what}",
            label,
            help=(f"def {skill.function}(observed: Observation, inputs: Inputs{more}) -> SkillBody: ...",),
        )
    return None


def _is_generator(function: _Function) -> bool:
    """Tell whether the function itself yields, not counting functions nested in it."""
    pending: list[ast.AST] = list(function.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Yield | ast.YieldFrom):
            return True
        if not isinstance(node, _Function | ast.Lambda | ast.ClassDef):
            pending.extend(ast.iter_child_nodes(node))
    return False


def _functions(tree: ast.Module) -> dict[str, _Function]:
    return {node.name: node for node in tree.body if isinstance(node, _Function)}
