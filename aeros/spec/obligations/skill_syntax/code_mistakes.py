"""Mistakes of skill code that show without a run: lost actions, unknown keys, actions that are always denied.

An action is always denied if it lacks a parameter of its kind, or if a constant is outside of the envelope.

Only what is certain is reported: a key that is written out, of a name that can only be the observation or the
inputs; and a parameter that is written as a number, truth value, text or tuple of numbers, or as the name of
such a constant of the same file.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, did_you_mean
from aeros.spec.diagnostics.grammar import an
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.skill_syntax.action_calls import action_calls, written_parameters
from aeros.spec.obligations.skill_syntax.bound_names import names_bound_by
from aeros.spec.obligations.skill_syntax.mapping_keys import listed_names, missing_keys, parameters_of_type
from aeros.spec.obligations.skill_syntax.model_mistakes import model_mistakes
from aeros.spec.obligations.skill_syntax.neighbours import ModuleFiles, files_run_by
from aeros.spec.obligations.skill_syntax.returned_keys import undeclared_keys


def first_code_mistake(skill: Skill, ecm: Ecm, site: Site, files: ModuleFiles) -> Diagnostic | None:
    """Find the first mistake in the code of a skill, whose actions are known to be written out.

    Args:
        skill: the skill.
        ecm: its module.
        site: the site, with the variables of the modules.
        files: the module's files.

    Returns:
        The mistake; None if there is none.
    """
    path = f"{skill.module_name}.py"
    mistakes = (
        *_lost_actions(path, skill, files),
        *_unknown_keys(path, skill, ecm, site, files),
        *_incomplete_actions(path, skill, ecm, site, files),
        *_actions_outside_envelope(path, skill, ecm, site, files),
    )
    return next(iter(mistakes), None)


def _lost_actions(path: str, skill: Skill, files: ModuleFiles) -> Iterator[Diagnostic]:
    """Yield calls whose value is dropped although it is an action, or asks for some."""
    for file, call in action_calls(path, skill.function, files):
        if call in file.dropped_values:
            yield Diagnostic(
                "AE146",
                f"`{skill.id}` makes an action and does not ask for it",
                SpanLabel(file.span(call), "has no effect"),
                help=("write `yield` before it",),
            )
    for file in files_run_by(path, files).values():
        for node in file.nodes_in_order:
            match node:
                case ast.Expr(value=ast.Call(func=ast.Name(id=name)) as call) if name in file.generators:
                    if sum(names_bound_by(one).count(name) for one in file.nodes) == 1:
                        yield Diagnostic(
                            "AE146",
                            f"`{name}` is called, and the actions that it yields are not asked for",
                            SpanLabel(file.span(call), "has no effect"),
                            help=("write `yield from` before it",),
                        )


def _unknown_keys(path: str, skill: Skill, ecm: Ecm, site: Site, files: ModuleFiles) -> Iterator[Diagnostic]:
    """Yield keys of observations and inputs that are never there."""
    measured = _observable_names(ecm, site)
    given = {name.removeprefix("inputs."): one for name, one in skill.inputs.items()}
    executed = files_run_by(path, files)
    for file in executed.values():
        for function in file.functions.values():
            for name in parameters_of_type(function, "Observation"):
                yield from missing_keys(
                    file, function, name, measured, "a state variable that this module may read"
                )
    entry = executed[path].functions.get(skill.function)
    if entry is not None and len(entry.args.args) >= 2:
        file, (observed, inputs) = executed[path], (one.arg for one in entry.args.args[:2])
        if observed not in parameters_of_type(entry, "Observation"):
            yield from missing_keys(
                file, entry, observed, measured, "a state variable that this module may read"
            )
        yield from missing_keys(file, entry, inputs, given, f"an input of `{skill.id}`")
    if entry is not None:
        noun = f"an output of `{skill.id}`"
        yield from undeclared_keys(executed[path], entry, ast.Return, skill.outputs, noun)
        for models in parameters_of_type(entry, "Models"):
            noun = f"a model of `{skill.id}`"
            yield from missing_keys(executed[path], entry, models, skill.models, noun)
            received = {name: ecm.models[name] for name in skill.models}
            yield from model_mistakes(executed[path], entry, models, received)


def _observable_names(ecm: Ecm, site: Site) -> dict[str, Declared]:
    """Return the state variables by the names under which a skill of the module may find them."""
    known: dict[str, Declared] = {}
    for name, declared in site.state.items():
        module, dot, short = name.partition(".")
        own = [one for one, bound in ecm.names.variables.items() if bound == name]
        if not dot:
            known |= dict.fromkeys((*own, name), declared)
        elif module == ecm.id:
            known[short] = declared
        elif module in ecm.required_modules:
            known[name] = declared
    return known


def _incomplete_actions(
    path: str, skill: Skill, ecm: Ecm, site: Site, files: ModuleFiles
) -> Iterator[Diagnostic]:
    """Yield actions that lack parameters of their kind."""
    for file, call in action_calls(path, skill.function, files):
        kind, asked = _text(call.args[0]), written_parameters(call)
        if kind is None or asked is None:
            continue
        declared = site.kinds[ecm.names.kinds.get(kind, kind)].parameters
        missing = [name for name in declared if name not in asked]
        if missing:
            added = ", ".join(f"{name}=…" for name in missing)
            yield Diagnostic(
                "AE149",
                f"this `{kind}` has no {_listed(missing)}, so it is always denied",
                SpanLabel(file.span(call), "always denied"),
                (SpanLabel(declared[missing[0]].span, "declared here"),),
                help=(f"add `{added}`: every parameter of an action must be given",),
            )


def _listed(names: Sequence[str]) -> str:
    quoted = [f"`{name}`" for name in names]
    return " and ".join([*([", ".join(quoted[:-1])] if quoted[1:] else []), quoted[-1]])


def _actions_outside_envelope(
    path: str, skill: Skill, ecm: Ecm, site: Site, files: ModuleFiles
) -> Iterator[Diagnostic]:
    """Yield actions whose written-out parameters are out of range, or break a condition of the envelope."""
    for file, call in action_calls(path, skill.function, files):
        kind = _text(call.args[0])
        if kind is None:
            continue
        name = ecm.names.kinds.get(kind, kind)
        declared = site.kinds[name].parameters
        values: dict[str, Any] = {}
        named: dict[str, str] = {}
        for keyword, written in _parameter_nodes(call):
            variable, node = declared[keyword], _without_names(written, file.constants)
            type_, text = variable.variable.type, _text(node)
            if node is not written and _is_literal(node):
                named[variable.name] = f"`{ast.unparse(written)}` is {ast.unparse(node)}"
            value = _constant_value(node, type_, ecm.names.cameras)
            if value is None and isinstance(type_, EnumType) and text is not None:
                own = [one for one, bound in ecm.names.cameras.items() if bound in type_.members]
                near = did_you_mean(text, [*own, *type_.members])
                members = listed_names(own or type_.members)
                yield Diagnostic(
                    "AE148",
                    f"`{keyword}` of this `{kind}` is `{text}`, which is no member of `{type_}`",
                    SpanLabel(file.span(written), "always denied"),
                    help=(f"did you mean `{near}`?" if near else f"one of {members}",),
                )
                return
            if value is None and not isinstance(type_, FamilyType) and _is_literal(node):
                yield Diagnostic(
                    "AE148",
                    f"`{keyword}` of this `{kind}` is `{ast.unparse(node)}`, which is no {type_}",
                    SpanLabel(file.span(written), "always denied"),
                    (SpanLabel(variable.span, "declared here"),),
                )
                return
            if value is None:
                continue
            values[variable.name] = value
            low, high = variable.range or (None, None)
            parts = value if isinstance(value, tuple) else (value,)
            if low is not None and high is not None and not all(low <= part <= high for part in parts):
                bounds = " to ".join(format_quantity(one, variable.unit) for one in (low, high))
                headline = f"`{keyword}` of this `{kind}` is outside its range, {bounds}"
                yield Diagnostic(
                    "AE148", headline, SpanLabel(file.span(written)), notes=_notes(named, [variable.name])
                )
                return
        for part in skill.envelope[name].conjuncts:
            names = t.variables_of(part.term).keys()
            if names and names <= values.keys() and not is_true(part.term, values):
                yield Diagnostic(
                    "AE148",
                    f"`{skill.id}` asks for {an(kind)} outside of its envelope, which is always denied",
                    SpanLabel(file.span(call), "always denied"),
                    (SpanLabel(part.span, "false for these parameters"),),
                    notes=(*_notes(named, names), *_rounding_note(part.term, values, names)),
                    help=("correct the parameter, or widen the envelope",),
                )
                return


def _parameter_nodes(call: ast.Call) -> Iterator[tuple[str, ast.expr]]:
    """Yield the parameters of an action that are written out."""
    yield from ((one.arg, one.value) for one in call.keywords if one.arg is not None)
    if len(call.args) == 2 and isinstance(call.args[1], ast.Dict):
        for key, value in zip(call.args[1].keys, call.args[1].values, strict=True):
            if isinstance(key, ast.Constant) and isinstance(key.value, str):
                yield key.value, value


def _notes(constants: Mapping[str, str], parameters: Iterable[str]) -> tuple[str, ...]:
    """Return the notes of these parameters, in the order of their names."""
    return tuple(constants[one] for one in sorted(parameters) if one in constants)


def _without_names(node: ast.expr, constants: Mapping[str, ast.expr]) -> ast.expr:
    """Put constants of the file in place of their names; return the same node if there are none."""
    match node:
        case ast.Name(id=name) if name in constants:
            return constants[name]
        case ast.Tuple(elts=parts):
            values = [_without_names(part, constants) for part in parts]
            return node if values == parts else ast.Tuple(values, ast.Load())
    return node


def _constant_value(node: ast.expr, type_: Type, cameras: Mapping[str, str]) -> Any:
    """Return the value that the gate gets for an expression; None if it is not a constant of the type."""
    if not _is_literal(node):
        return None
    value = ast.literal_eval(node)
    if isinstance(type_, BoolType):
        return value if isinstance(value, bool) else None
    if isinstance(type_, EnumType):
        name = cameras.get(value, value) if isinstance(value, str) else None
        return name if name in type_.members else None
    if isinstance(type_, VectorType):
        parts = value if isinstance(value, tuple | list) and len(value) == 3 else ()
        numbers = tuple(_number(part) for part in parts)
        return numbers if len(numbers) == 3 and None not in numbers else None
    return _number(value) if isinstance(type_, RealType | IntegerType) else None


def _is_literal(node: ast.expr) -> bool:
    """Tell if an expression is a value that is written out."""
    try:
        ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return False
    return True


def _rounding_note(term: t.Term, values: Mapping[str, Any], names: Iterable[str]) -> tuple[str, ...]:
    """Explain that a condition is false only because of the rounding of decimals, if that is so."""
    decimals = {name: _decimal(value) for name, value in values.items()}
    rounded = [name for name in names if decimals[name] != values[name]]
    if not rounded or not is_true(term, decimals):
        return ()
    numbers = ", ".join(f"`{name}`" for name in sorted(rounded))
    return (f"bounds are exact, and Python rounds the number of {numbers} to a double beyond the bound",)


def _decimal(value: Any) -> Any:
    """Return the decimal that a person reads for a double."""
    if isinstance(value, tuple):
        return tuple(_decimal(part) for part in value)
    return Fraction(repr(float(value))) if isinstance(value, Fraction) else value


def _text(node: ast.expr) -> str | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def _number(value: object) -> Fraction | None:
    """Return the exact value of a number of code, which reaches the gate as a double."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        return Fraction(float(value)) if is_number else None  # type: ignore[arg-type]
    except (OverflowError, ValueError):  # too large, or not finite
        return None
