"""Claims about the entry points of skills and perceivers, settled by reading the code: nothing is run."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.model.ecm import Ecm
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile, UnreadableCodeError
from aeros.spec.obligations.verdicts import StaticClaim

_Function = ast.FunctionDef | ast.AsyncFunctionDef


def entry_point_obligations(
    ecm: Ecm, files: Mapping[str, SkillFile | UnreadableCodeError]
) -> Iterator[StaticClaim]:
    """Claim that every entry point exists and is a generator function of the arguments that it gets.

    A skill's function takes the observation and the inputs, and the models if the skill declares any; a
    perceiver's takes the view, and the models likewise.  A file has entry points of skills or of perceivers,
    never of both: their code may use different names.

    Args:
        ecm: the module.
        files: the module's Python files by path relative to its folder.

    Yields:
        A claim for each skill and each perceiver.
    """
    for skill in ecm.skills.values():
        kind = _SKILL_WITH_MODELS if skill.models else _SKILL
        found = _entry_point_error(skill.module_name, skill.function, skill.entry_span, files, kind)
        yield StaticClaim(ClaimForm.ENTRY_POINT(skill.id), found)
    of_skills = {skill.module_name: skill for skill in ecm.skills.values()}
    for one in ecm.perceivers.values():
        kind = _PERCEIVER_WITH_MODELS if one.models else _PERCEIVER
        found = _entry_point_error(one.module_name, one.function, one.entry_span, files, kind)
        if found is None and one.module_name in of_skills:
            found = Diagnostic(
                "AE123",
                f"`{one.module_name}.py` has entry points of skills, and of the perceiver `{one.id}`",
                SpanLabel(one.entry_span),
                (SpanLabel(of_skills[one.module_name].entry_span, "a skill's"),),
                help=("put the perceivers into a file of their own, which may import numpy",),
            )
        yield StaticClaim(ClaimForm.PERCEIVER_ENTRY_POINT(one.id), found)


@dataclass(frozen=True)
class _EntryKind:
    """Form of an entry point: its arguments, and the words about it.

    Attributes:
        arguments: number of arguments.
        described: the arguments in words.
        example: signature of such a function; `{}` stands for its name.
        lack: a function that is no generator cannot do this.
        advice: advice on how to write a generator.
    """

    arguments: int
    described: str
    example: str
    lack: str
    advice: str


_SKILL: Final = _EntryKind(
    2,
    "the observation and the inputs",
    "def {}(observed: Observation, inputs: Inputs) -> SkillBody: ...",
    "it could ask for no action",
    "`yield act(...)` each action and receive the observation measured after it",
)
_SKILL_WITH_MODELS: Final = replace(
    _SKILL,
    arguments=3,
    described="the observation, the inputs and the models",
    example="def {}(observed: Observation, inputs: Inputs, models: Models) -> SkillBody: ...",
)
_PERCEIVER: Final = _EntryKind(
    1,
    "the view",
    "def {}(view: View) -> Perception: ...",
    "it could measure only once",
    "`yield` the values by name and receive the next view",
)
_PERCEIVER_WITH_MODELS: Final = replace(
    _PERCEIVER,
    arguments=2,
    described="the view and the models",
    example="def {}(view: View, models: Models) -> Perception: ...",
)


def _entry_point_error(
    module: str,
    name: str,
    at: SourceSpan,
    files: Mapping[str, SkillFile | UnreadableCodeError],
    kind: _EntryKind,
) -> Diagnostic | None:
    path, label = f"{module}.py", SpanLabel(at)
    file = files.get(path)
    if file is None:
        near = did_you_mean(path, files)
        help_ = (f"did you mean `{near}`?",) if near else ()
        return Diagnostic("AE123", f"there is no `{path}` in this module", label, help=help_)
    if isinstance(file, UnreadableCodeError):
        return file.diagnostic
    functions = _functions(file.tree)
    function = functions.get(name)
    if function is None:
        near = did_you_mean(name, functions)
        help_ = (f"did you mean `{near}`?",) if near else ()
        return Diagnostic("AE123", f"`{path}` has no function `{name}`", label, help=help_)
    if isinstance(function, ast.AsyncFunctionDef) or not _is_generator(function):
        return Diagnostic(
            "AE124",
            f"`{name}` is not a generator, so {kind.lack}",
            label,
            notes=(f"it is defined at line {function.lineno} of `{path}`",),
            help=(kind.advice,),
        )
    if function.decorator_list:
        return Diagnostic(
            "AE124",
            f"`{name}` is decorated, so another function may run in its place",
            label,
            help=("remove the decorator",),
        )
    arguments = function.args
    if len(arguments.posonlyargs) + len(arguments.args) != kind.arguments or arguments.kwonlyargs:
        return Diagnostic(
            "AE124",
            f"`{name}` does not take {kind.described}",
            label,
            help=(kind.example.format(name),),
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
