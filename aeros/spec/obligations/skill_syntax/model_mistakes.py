"""Calls of models with inputs that they do not have, and outputs that they never give.

As in `code_mistakes`, only what is certain is reported: a model that is named where it is called, and an
output that is asked for in the same expression.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.model.models import ModuleModel
from aeros.spec.obligations.skill_syntax.bound_names import names_bound_by
from aeros.spec.obligations.skill_syntax.mapping_keys import unknown_key
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile


def model_mistakes(
    file: SkillFile, function: ast.FunctionDef, parameter: str, models: Mapping[str, ModuleModel]
) -> Iterator[Diagnostic]:
    """Find calls of models, and requests of their outputs, that fail whenever they are reached.

    Args:
        file: the file of the function.
        function: the function.
        parameter: its parameter that holds the models.
        models: the models that it receives, by name.

    Yields:
        A diagnostic for each input that a model lacks or is not given, and for each output that it lacks.
    """
    nodes = file.nodes_of(function)
    bound = [name for node in nodes for name in names_bound_by(node)]
    if bound.count(parameter) != 1:  # the parameter itself
        return
    for node in nodes:
        match node:
            case ast.Call() if (model := _called_model(node, parameter, models)) is not None:
                yield from _input_mistakes(file, node, model)
            case ast.Subscript(
                value=ast.Call() as call, slice=ast.Constant(value=str(key)) as place, ctx=ast.Load()
            ) if (model := _called_model(call, parameter, models)) is not None and key not in model.outputs:
                yield unknown_key(file, place, key, model.outputs, f"an output of the model `{model.id}`")


def _called_model(call: ast.Call, parameter: str, models: Mapping[str, ModuleModel]) -> ModuleModel | None:
    """Return the model whose `run` is called, as in `models["gauge"].run(level=0.2)`."""
    match call.func:
        case ast.Attribute(
            value=ast.Subscript(value=ast.Name(id=asked), slice=ast.Constant(value=str(name))), attr="run"
        ) if asked == parameter:
            return models.get(name)
    return None


def _input_mistakes(file: SkillFile, call: ast.Call, model: ModuleModel) -> Iterator[Diagnostic]:
    for keyword in call.keywords:
        if keyword.arg is not None and keyword.arg not in model.inputs:
            noun = f"an input of the model `{model.id}`"
            yield unknown_key(file, keyword, keyword.arg, model.inputs, noun)
    given = {keyword.arg for keyword in call.keywords}
    missing = [name for name in model.inputs if name not in given]
    if missing and None not in given and not call.args:
        added = ", ".join(f"{name}=…" for name in missing)
        headline = f"the model `{model.id}` is not given its input `{missing[0]}`"
        yield Diagnostic("AE147", headline, SpanLabel(file.span(call)), help=(f"add `{added}`",))
