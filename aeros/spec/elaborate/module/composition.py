"""Elaboration of declared compositions to graphs of steps over a module's skills.

Every fault is reported, and a composition with a fault is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any, Final

from aeros.spec.declared import composition as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_expression
from aeros.spec.elaborate.module.callables import CallableNames
from aeros.spec.elaborate.module.stoppable_parts import check_stop, elaborate_stoppable_part, first_line_span
from aeros.spec.elaborate.module.tasks import NEEDS_RETRY
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.elaborate.values import elaborate_value
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import STOP_ON_FAILURE, Composition, OutputReference, Part, Step, nested
from aeros.spec.model.ecm import Skill
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    If,
    Par,
    RetriedPart,
    Seq,
    steps_of,
)
from aeros.spec.text.fields import ChoiceField, ExpressionField, IntegerField, MappingField, TextField

_OWN_ID: Final = "give this one an `id` of its own"
_FORMS: Final = ("seq", "par", "any", "tolerate", "if", "check", "hold", "timeout", "skill")
_FIELD_OF: Final = {"if": "if_"}
_STEP_FIELDS = ("id", "inputs", "between_tries", "on_failure")


def elaborate_compositions(
    entries: MappingField[declared.Composition],
    site: Site,
    names: CallableNames,
    diagnostics: Diagnostics,
) -> dict[str, Composition]:
    """Elaborate the compositions of a module; report each fault and leave out the compositions that have one.

    Args:
        entries: declared compositions by name.
        site: site under which the module is elaborated; its names and retry limit apply.
        names: skills and capabilities that steps may name, with the sequences that provide some of them.
        diagnostics: receives the faults.

    Returns:
        The compositions without faults, by name, and those sequences.
    """
    compositions: dict[str, Composition] = {}
    for name, one in _callees_first(entries, names, diagnostics):
        if name.value in names.skills:
            diagnostics.error(
                "AE121",
                f"`{name.value}` is a skill already",
                name.span,
                help=("choose another name for the composition",),
            )
        known = replace(names, compositions={**names.compositions, **compositions})
        elaborated = _Elaborator(one, site, known, diagnostics).composition(name)
        if elaborated is not None:
            compositions[name.value] = elaborated
    written = (name.value for name, _ in entries)
    return {name: compositions[name] for name in written if name in compositions} | dict(names.compositions)


def _callees_first(
    entries: MappingField[declared.Composition], names: CallableNames, diagnostics: Diagnostics
) -> list[tuple[TextField, declared.Composition]]:
    """Order compositions so that each stands after those that its steps run; report a cycle of them."""
    by_name = {name.value: (name, one) for name, one in entries}
    calls = {
        name: [
            run
            for part in _subparts(one.do)
            if part.skill is not None
            for run in names.capabilities.get(part.skill.value, ())
            if run in by_name
        ]
        for name, (_, one) in by_name.items()
    }
    try:
        return [by_name[name] for name in TopologicalSorter(calls).static_order()]
    except CycleError as error:
        cycle: list[str] = error.args[1]
        headline = "compositions run each other in a cycle: " + " → ".join(f"`{one}`" for one in cycle)
        diagnostics.error("AE122", headline, by_name[cycle[0]][0].span)
        return []


def elaborate_sequence(
    items: tuple[TextField, ...], name: str, names: CallableNames, diagnostics: Diagnostics
) -> Composition | None:
    """Elaborate skills in sequence, as an alternative of a capability, to a composition.

    Args:
        items: names of skills.
        name: name of the composition.
        names: skills and capabilities that steps may name.
        diagnostics: receives the faults.

    Returns:
        The composition, which may start where its first skill can; None after a report.
    """
    before = len(diagnostics)
    if len(items) < 2:
        span = items[0].span if items else None
        diagnostics.error("AE112", "a sequence has at least two skills", span)
        return None
    steps: list[Step] = []
    first = None
    for number, item in enumerate(items, 1):
        skill = resolve_name(item, names.skills, "a skill of this module", diagnostics)
        if skill is None:
            continue
        first = first or skill
        missing = [key for key, one in skill.inputs.items() if one.default_value is None]
        for key in missing:
            diagnostics.error("AE102", f"`{skill.id}` needs the input `{key}`", item.span)
        inputs = {key: one.default_value for key, one in skill.inputs.items()}
        id_ = skill.id if skill.id not in {one.id for one in steps} else f"{skill.id}_{number}"
        steps.append(Step(id_, skill.id, inputs, {}, 0, None, STOP_ON_FAILURE, item.span))
    if first is None or len(diagnostics) > before:
        return None
    clause = first.precondition
    return Composition(
        name,
        t.TRUE if clause is None else clause.term,
        None if clause is None else clause.span,
        Seq(tuple(steps)),
        {},
        items[0].span,
    )


@dataclass(frozen=True)
class _InvocationFields:
    """The fields that a step and a handler have in common."""

    skill: TextField
    inputs: tuple[tuple[TextField, ExpressionField | declared.OutputReference], ...]
    retry: IntegerField | None
    between_tries: TextField | None
    on_failure: TextField | None


def _subparts(part: declared.Part) -> Iterator[declared.Part]:
    yield part
    inner: list[object] = [*(part.seq or ()), *(part.par or ()), *(part.any or ())]
    inner += [one for one in (part.tolerate, part.part, part.then, part.else_) if one is not None]
    for one in (one for one in inner if isinstance(one, declared.Part)):
        yield from _subparts(one)


class _Elaborator:
    def __init__(
        self,
        composition: declared.Composition,
        site: Site,
        names: CallableNames,
        diagnostics: Diagnostics,
    ) -> None:
        self._declared = composition
        self._site = site
        self._names = names
        self._diagnostics = diagnostics
        self._named = {name.value: handler for name, handler in composition.handlers}
        self._steps: dict[str, TextField] = {}
        self._handlers: dict[str, Step] = {}
        self._around = ""

    def composition(self, name: TextField) -> Composition | None:
        one, before = self._declared, len(self._diagnostics)
        for part in _subparts(one.do):
            if part.skill is not None:
                self._register_name(part.id or part.skill, part.skill)
        for handler_name, handler in one.handlers:
            if handler_name.value == STOP_ON_FAILURE:
                self._diagnostics.error(
                    "AE121",
                    "a handler cannot be named `stop`: `on_failure: stop` ends the composition",
                    handler_name.span,
                )
            run = _InvocationFields(
                handler.skill, handler.inputs.items, handler.retry, handler.between_tries, handler.on_failure
            )
            step = self._step(handler_name.value, run, handler_name.span)
            if step is not None:
                self._handlers[handler_name.value] = step
        precondition = None
        if one.precondition is not None:
            precondition = elaborate_expression(one.precondition, state_scope(self._site), self._diagnostics)
        body = self._part(one.do)
        if body is not None and not any(steps_of(body)):
            self._diagnostics.error(
                "AE112", "a composition has at least one step", first_line_span(one.do.span)
            )
        if body is None or len(self._diagnostics) > before:
            return None
        span = None if one.precondition is None else one.precondition.span
        return Composition(name.value, precondition or t.TRUE, span, body, self._handlers, name.span)

    def _register_name(self, name: TextField, skill: TextField) -> None:
        if name.value in self._steps:
            self._diagnostics.error(
                "AE120",
                f"two steps of this composition are named `{name.value}`",
                name.span,
                help=(_OWN_ID,),
            )
        self._steps[name.value] = skill

    def _register_nested(self, name: TextField, ids: Sequence[str], handlers: Mapping[str, Step]) -> None:
        """Register the names of steps and handlers inside a part that stands for a composition."""
        doubled = [id_ for id_ in ids if id_ in self._steps]
        doubled += [id_ for id_ in handlers if id_ in self._handlers or id_ in self._named]
        if doubled and not any(one.code == "AE120" for one in self._diagnostics):
            headline = f"two steps or handlers of this composition are named `{doubled[0]}`"
            self._diagnostics.error("AE120", headline, name.span, help=(_OWN_ID,))
        self._steps |= dict.fromkeys(ids, name)
        self._handlers |= handlers

    def _part(self, part: declared.Part) -> Part | None:
        forms = [name for name in _FORMS if getattr(part, _FIELD_OF.get(name, name)) is not None]
        if len(forms) != 1:
            found = "none of them" if not forms else " and ".join(f"`{form}`" for form in forms)
            listed = ", ".join(f"`{one}`" for one in _FORMS[:-1])
            self._report(
                f"a part has exactly one of {listed} and `{_FORMS[-1]}`; found {found}",
                first_line_span(part.span),
            )
            return None
        for headline in _misplaced_fields(part, forms[0]):
            self._report(headline, first_line_span(part.span))
        around = self._around
        if part.retry is not None and part.skill is None:
            self._around = "the `retry` around it tries again"
        built = self._form(part)
        self._around = around
        if part.skill is not None or part.retry is None or built is None:
            return built
        self._check_retry(part.retry)
        return RetriedPart(built, part.retry.value, part.retry.span) if part.retry.value else built

    def _form(self, part: declared.Part) -> Part | None:
        """Build a part without its `retry`; a step has its own."""
        if part.skill is not None:
            name = part.id or part.skill
            run = _InvocationFields(
                part.skill, part.inputs.items, part.retry, part.between_tries, part.on_failure
            )
            composition = self._sole_composition(run)
            check_stop(part, f"`{name.value}`", self._around, self._diagnostics)
            if composition is not None:
                body, handlers = nested(name.value, composition, part.skill.span)
                self._register_nested(name, [step.id for step in steps_of(body)], handlers)
                return body
            return self._step(name.value, run, part.skill.span)
        if part.if_ is not None:
            return self._if(part, part.if_)
        if part.hold is not None or part.timeout is not None:
            check_stop(part, "this part", self._around, self._diagnostics)
            return elaborate_stoppable_part(part, self._part, self._site, self._diagnostics)
        if part.check is not None:
            term = elaborate_expression(part.check, state_scope(self._site), self._diagnostics)
            text, span = part.check.value, part.check.span
            return None if term is None else If(term, text, Seq(()), FailingPart(text, span), span)
        span = first_line_span(part.span)
        if part.tolerate is not None:
            tolerated = self._part_that_may_fail(part.tolerate, "the `tolerate` around it goes on")
            return None if tolerated is None else Fallback((tolerated, Seq(())), span)
        inner = part.seq or part.par or part.any or ()
        if len(inner) < (1 if part.seq is not None else 2):
            needed = "a `par` has at least two branches"
            if part.seq is not None:
                needed = "a `seq` has at least one part"
            elif part.any is not None:
                needed = "an `any` has at least two alternatives"
            self._diagnostics.error("AE112", needed, span)
        again = [part.any is not None and number < len(inner) for number in range(1, len(inner) + 1)]
        built = [
            self._part_that_may_fail(one, "the `any` around it goes on") if goes_on else self._part(one)
            for one, goes_on in zip(inner, again, strict=True)
        ]
        parts = tuple(one for one in built if one is not None)
        if part.seq is not None:
            return Seq(parts)
        if part.any is not None:
            return Fallback(parts, span)
        for one in parts:
            if not any(steps_of(one)):
                self._diagnostics.error("AE112", "a branch of a `par` has at least one step", span)
        return Par(parts, span)

    def _part_that_may_fail(self, part: declared.Part, then: str) -> Part | None:
        """Build a part after whose failure something follows, which `then` says."""
        around, self._around = self._around, then
        built = self._part(part)
        self._around = around
        return built

    def _if(self, part: declared.Part, condition: ExpressionField) -> If[Step] | None:
        term = elaborate_expression(condition, state_scope(self._site), self._diagnostics)
        if part.then is None:
            self._report("an `if` needs a `then`", condition.span)
            return None
        then = self._part(part.then)
        otherwise: Part | None = None
        if isinstance(part.else_, ChoiceField):
            otherwise = Seq(())
        elif part.else_ is not None:
            otherwise = self._part(part.else_)
        if term is None or then is None:
            return None
        return If(term, condition.value, then, otherwise, condition.span)

    def _sole_composition(self, run: _InvocationFields) -> Composition | None:
        """Return the composition that a step stands for: the only alternative of a capability."""
        found = self._names.alternatives(run.skill, Diagnostics())
        composition = found[0].composition if len(found) == 1 else None
        if composition is None:
            return None
        if run.inputs:
            headline = f"`{composition.id}`, which provides `{run.skill.value}`, has no inputs"
            self._report(headline, run.skill.span)
        for field in (run.retry, run.between_tries, run.on_failure):
            if field is not None and field.value != STOP_ON_FAILURE:
                headline = f"`{run.skill.value}` cannot be tried again or recovered here: steps of it are"
                self._diagnostics.error("AE122", headline, field.span)
        return composition

    def _step(self, name: str, run: _InvocationFields, span: SourceSpan) -> Step | None:
        skills = self._names.skills_for(run.skill, self._diagnostics)
        if run.between_tries is not None and run.retry is None:
            self._report(NEEDS_RETRY, run.between_tries.span)
        between = None if run.between_tries is None else self._handler(run.between_tries)
        last: str | None = None
        if run.on_failure is not None:
            is_stop = run.on_failure.value == STOP_ON_FAILURE
            last = STOP_ON_FAILURE if is_stop else self._handler(run.on_failure)
        if run.retry is not None:
            self._check_retry(run.retry)
        if not skills:
            return None
        (constants, flows), *_ = [self._inputs(run, skill) for skill in skills]
        retry = 0 if run.retry is None else run.retry.value
        choices = () if skills[0].id == run.skill.value else tuple(one.id for one in skills)
        return Step(name, run.skill.value, constants, flows, retry, between, last, span, choices)

    def _check_retry(self, retry: IntegerField) -> None:
        limit = self._site.limits.retries
        if retry.value > limit:
            self._diagnostics.error(
                "AE129", f"this site allows at most {limit} retries of a step", retry.span
            )

    def _handler(self, name: TextField) -> str:
        """Return the handler's name; a skill that is not a named handler becomes one."""
        if name.value not in self._named and name.value not in self._handlers:
            step = self._step(name.value, _InvocationFields(name, (), None, None, None), name.span)
            if step is not None:
                self._handlers[name.value] = step
        return name.value

    def _inputs(
        self, run: _InvocationFields, skill: Skill
    ) -> tuple[dict[str, Any], dict[str, OutputReference]]:
        constants = {
            name: one.default_value for name, one in skill.inputs.items() if one.default_value is not None
        }
        flows: dict[str, OutputReference] = {}
        for name, given in run.inputs:
            variable = resolve_name(name, skill.inputs, f"an input of `{skill.id}`", self._diagnostics)
            if variable is None:
                continue
            if isinstance(given, declared.OutputReference):
                flow = self._output_reference(given)
                if flow is not None:
                    constants.pop(name.value, None)
                    flows[name.value] = flow
                continue
            constants[name.value] = elaborate_value(given, variable, self._site, self._diagnostics)
        written = {name.value for name, _ in run.inputs}
        for missing in skill.inputs.keys() - constants.keys() - flows.keys() - written:
            self._report(f"`{skill.id}` needs the input `{missing}`", run.skill.span)
        return constants, flows

    def _output_reference(self, given: declared.OutputReference) -> OutputReference | None:
        text = given.from_
        step, _, output = text.value.partition(".")
        source = self._steps.get(step)
        skills = () if source is None else self._names.skills_for(source, Diagnostics())
        outputs = [
            name
            for name in (skills[0].outputs if skills else ())
            if all(name in one.outputs for one in skills)
        ]
        resolve_name(
            text, {f"{step}.{name}": None for name in outputs}, "an output of a step", self._diagnostics
        )
        return OutputReference(step, output, text.span) if output in outputs else None

    def _report(self, headline: str, at: SourceSpan) -> None:
        self._diagnostics.error("AE102", headline, at)


def _misplaced_fields(part: declared.Part, form: str) -> Iterator[str]:
    """Report fields that have no meaning in a part of this form."""
    fields = [] if form == "skill" else [*_STEP_FIELDS]
    if form in ("hold", "timeout"):
        fields.remove("on_failure")
    for name in fields:
        value = getattr(part, name)
        if value is not None and value != MappingField():
            yield f"`{name}` belongs to a step with a `skill`"
    if form not in ("hold", "timeout") and part.part is not None:
        yield "`part` belongs to a `hold` or a `timeout`"
    if form != "if" and (part.then is not None or part.else_ is not None):
        yield "`then` and `else` belong to an `if`"
