"""Elaboration of parts of compositions that run under a held condition or within a time."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from aeros.spec.declared import composition as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.module.action_conditions import elaborate_hold
from aeros.spec.expr.units import TIME
from aeros.spec.model.composition import STOP_ON_FAILURE, Part, Step
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import HeldPart, StoppablePart, TimedPart, steps_of
from aeros.spec.text.fields import TextField


def elaborate_stoppable_part(
    part: declared.Part,
    build: Callable[[declared.Part], Part | None],
    site: Site,
    diagnostics: Diagnostics,
) -> StoppablePart[Step] | None:
    """Elaborate a part of the form `hold` or `timeout`.

    Args:
        part: the declared part.
        build: elaborates the part that runs meanwhile.
        site: site under which the module is elaborated.
        diagnostics: receives the faults.

    Returns:
        The part; None after a report.
    """
    span = first_line_span(part.span)
    form = "timeout" if part.hold is None else "hold"
    if part.on_failure is not None and part.on_failure.value != STOP_ON_FAILURE:
        headline = f"a `{form}` has no handler: `on_failure` is `stop` or absent; put it into `any` instead"
        diagnostics.error("AE102", headline, part.on_failure.span)
    stops = part.on_failure is not None
    limit = None if part.timeout is None else _time_limit(part.timeout, diagnostics)
    hold = elaborate_hold(part.hold, site, diagnostics, {})
    if part.part is None:
        diagnostics.error("AE102", f"a `{form}` needs a `part`, which runs meanwhile", span)
        return None
    inner = build(part.part)
    if inner is None:
        return None
    if not any(steps_of(inner)):
        diagnostics.error("AE112", f"the `part` of a `{form}` has at least one step", span)
    if hold is not None:
        return HeldPart(inner, hold.span, stops, hold)
    return (
        None if limit is None or part.timeout is None else TimedPart(inner, part.timeout.span, stops, limit)
    )


def _time_limit(text: TextField, diagnostics: Diagnostics) -> Fraction | None:
    limit = elaborate_quantity(text, TIME, diagnostics)
    if limit is not None and limit <= 0:
        diagnostics.error("AE129", "a timeout must be above 0 s", text.span)
    return limit


def check_stop(part: declared.Part, name: str, around: str, diagnostics: Diagnostics) -> None:
    """Report a part that stops the composition, although something goes on after its failure.

    Args:
        part: the declared part.
        name: its name in the message.
        around: words on what goes on after its failure; empty if nothing does.
        diagnostics: receives the fault.
    """
    stop = part.on_failure
    if around and stop is not None and stop.value == STOP_ON_FAILURE:
        headline = f"{name} cannot stop the composition: {around} after its failure"
        diagnostics.error("AE102", headline, stop.span)


def first_line_span(span: SourceSpan) -> SourceSpan:
    """Return the first line of a span, which is underlined for a whole part.

    Args:
        span: place of the part.

    Returns:
        Its place up to the first end of a line.
    """
    end = span.source.text.find("\n", span.start, span.end)
    return span if end < 0 else SourceSpan(span.source, span.start, end)
