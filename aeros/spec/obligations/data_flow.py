"""Claims about data that flows between the steps of a composition: it is available and it fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import product

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.expr.units import Unit, format_number, to_unit
from aeros.spec.model.composition import Composition, OutputReference, Part, Step
from aeros.spec.model.ecm import Skill
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
    steps_of,
)
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim


def data_obligations(composition: Composition, skills: Mapping[str, Skill]) -> Iterator[StaticClaim]:
    """Claim that every input fed by an output can have it on every path and admits its whole range.

    Args:
        composition: the composition.
        skills: skills that the module may run, by name.

    Yields:
        Two claims for each such input: the output is available, and it fits.
    """
    available: dict[str, frozenset[str]] = {}
    _steps_succeeded(composition.body, frozenset(), available)
    steps = {step.id: step for step in steps_of(composition.body)}
    for step in steps.values():
        for name, flow in step.output_references.items():
            faults = [
                fault
                for run, source in product(step.runs, steps[flow.step].runs)
                if name in skills[run].inputs
                if (
                    fault := _type_mismatch(
                        name, flow, skills[source].outputs[flow.output], skills[run].inputs[name]
                    )
                )
                is not None
            ]
            available_before = flow.step in available[step.id]
            about = composition.id, step.id, name
            yield StaticClaim(
                ClaimForm.INPUT_AVAILABLE(*about),
                None if available_before else _output_unavailable(step, flow, steps),
            )
            yield StaticClaim(ClaimForm.INPUT_FITS(*about), faults[0] if faults else None)


def _steps_succeeded(
    part: Part, before: frozenset[str], succeeded_before: dict[str, frozenset[str]]
) -> frozenset[str]:
    """Return the steps that have succeeded after `part`; note those before each step in the last argument."""
    match part:
        case Step(id=name):
            succeeded_before[name] = before
            return before | {name}
        case Seq(parts=parts):
            for inner in parts:
                before = _steps_succeeded(inner, before, succeeded_before)
            return before
        case Par(branches=branches):
            return frozenset().union(
                *(_steps_succeeded(branch, before, succeeded_before) for branch in branches)
            )
        case If(then=then, otherwise=otherwise):
            after = _steps_succeeded(then, before, succeeded_before)
            return (
                after if otherwise is None else after & _steps_succeeded(otherwise, before, succeeded_before)
            )
        case Fallback(parts=parts):
            # All of them are walked; an alternative that always fails is among them, which says no more.
            ways = [_steps_succeeded(inner, before, succeeded_before) for inner in parts]
            return frozenset.intersection(*ways)
        case RetriedPart(part=inner) | StoppablePart(part=inner):
            return _steps_succeeded(inner, before, succeeded_before)
        case FailingPart():
            return before


def _output_unavailable(step: Step, flow: OutputReference, steps: Mapping[str, Step]) -> Diagnostic:
    return Diagnostic(
        "AE853",
        f"`{step.id}` takes an output of `{flow.step}`, which may not have run before it",
        SpanLabel(flow.span, "taken here"),
        (SpanLabel(steps[flow.step].span, "does not always come first"),),
        help=(f"put `{flow.step}` before `{step.id}` in a `seq`, outside `if`, `any` and `tolerate`",),
    )


def _type_mismatch(name: str, flow: OutputReference, output: Declared, input_: Declared) -> Diagnostic | None:
    output_type, input_type = output.variable.type, input_.variable.type
    if output_type != input_type:
        headline = f"`{flow.step}.{flow.output}` is {output_type}, but the input `{name}` is {input_type}"
        labels = (SpanLabel(output.span, str(output_type)), SpanLabel(input_.span, str(input_type)))
        return Diagnostic("AE852", headline, SpanLabel(flow.span), labels)
    if output.range is None or input_.range is None:
        return None
    (low, high), (least, most) = output.range, input_.range
    if least <= low and high <= most:
        return None
    shown = format_range(output.range, output.unit)
    return Diagnostic(
        "AE852",
        f"`{flow.step}.{flow.output}` may be outside the range of the input `{name}`",
        SpanLabel(flow.span),
        (SpanLabel(output.span, shown), SpanLabel(input_.span, format_range(input_.range, input_.unit))),
        help=("widen the input's range, or narrow the output's",),
    )


def format_range(bounds: tuple[Fraction, Fraction], unit: Unit) -> str:
    """Format a closed range for people.

    Args:
        bounds: its lowest and highest value, SI.
        unit: unit to write them in.

    Returns:
        Text as in `2 to 8 N`.
    """
    low, high = (format_number(to_unit(bound, unit)) for bound in bounds)
    return f"{low} to {high}" + ("" if unit.text == "1" else f" {unit.text}")
