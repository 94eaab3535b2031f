"""Claims about capabilities with an interface: every alternative that provides one keeps its promise.

- can-start: some state satisfies the precondition of the interface.
- fits: an alternative has the inputs and outputs; it accepts the range of each input, and keeps the range of
  each output. Its other inputs have defaults.
- ready: it can start wherever the precondition of the interface holds.
- achieved: after each of its successes, started there, what the interface promises holds.

The interface of a capability that a module provides is claimed of its own alternatives; that of one that it
requires, of the alternatives of all modules that provide it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

from aeros.spec.consequences.consequences import known_definitions, with_consequences
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.flow.symbolic_paths import TooManyPathsError, explore_paths
from aeros.spec.model.composition import STOP_ON_FAILURE, Composition, Step, handler_cycle
from aeros.spec.model.ecm import ActionCondition, Alternative, CapabilityInterface, Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.data_flow import format_range
from aeros.spec.obligations.obligation import ClaimMode, LabelledConjunct, Obligation, VariableSpace
from aeros.spec.obligations.outcomes.per_situation import obligation_per_situation, skills_of_steps
from aeros.spec.obligations.verdicts import StaticClaim

_CODE: Final = "AE307"


def interface_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    """Make every claim of group interface about a module.

    Args:
        ecm: the module.
        site: site under which it is elaborated, with the variables of the modules that it requires.

    Yields:
        Claims settled at once, and obligations for the solver.
    """
    ecm = with_consequences(ecm, site)
    for capability, interface in ecm.interfaces.items():
        yield from _can_start(capability, interface, site)
        for alternative in ecm.alternatives(capability):
            yield from _Provider(ecm, site, capability, interface, alternative).claims()


def _can_start(capability: str, interface: CapabilityInterface, site: Site) -> Iterator[Obligation]:
    """Claim that the precondition of an interface holds in some state: else its promise is empty."""
    if interface.precondition is not None:
        clause = interface.precondition
        yield Obligation(
            ClaimForm.INTERFACE_CAN_START(capability),
            _CODE,
            ClaimMode.SOMETIMES,
            VariableSpace((*site.state.values(), *interface.inputs.values()), ()),
            clause.term,
            f"no state satisfies the precondition of the interface of `{capability}`",
            SpanLabel(clause.span, "never true"),
            help=("correct the condition",),
        )


class _Provider:
    """One alternative of a capability, beside the capability's interface."""

    def __init__(
        self, ecm: Ecm, site: Site, capability: str, interface: CapabilityInterface, alternative: Alternative
    ) -> None:
        self._skills = ecm.callable_skills
        self._definitions = known_definitions(ecm)
        self._site = site
        self._interface = interface
        self._about = capability, alternative.name
        self._shown = f"`{alternative.name}`, which provides `{capability}`,"
        self._skill = None if alternative.composition else self._skills[alternative.name]
        self._composition = alternative.composition or _single_step(self._skills[alternative.name])
        given = tuple(interface.inputs.values())
        self._variables = (*site.state.values(), *given)

    def claims(self) -> Iterator[Obligation | StaticClaim]:
        """Yield all claims; where it does not fit, or is not explored, nothing further is asked."""
        misfit = self._misfit()
        yield StaticClaim(ClaimForm.INTERFACE_FITS(*self._about), misfit)
        if misfit is not None or handler_cycle(self._composition):
            return
        required = self._precondition()
        promised = self._interface.precondition
        assumed = () if promised is None else (promised.term,)
        if required is not None:
            yield self._ready(required, assumed)
        if self._interface.achieves is not None:
            start = t.And((*assumed, t.TRUE if required is None else required.term))
            yield from self._achieved(self._interface.achieves, start)

    def _misfit(self) -> Diagnostic | None:
        """Report the first input or output that does not fit; None if all do."""
        inputs = {} if self._skill is None else self._skill.inputs
        outputs = {} if self._skill is None else self._skill.outputs
        for name, asked in self._interface.inputs.items():
            if name not in inputs:
                return self._refusal(f"has no input `{name}`", asked.span)
            difference = _difference(asked, within=inputs[name])
            if difference is not None:
                words = f"accepts the input `{name}` {difference}"
                return self._refusal(words, asked.span, inputs[name].span)
        for name, one in inputs.items():
            if name not in self._interface.inputs and one.default_value is None:
                words = f"needs the input `{name}`, which the interface does not give"
                return self._refusal(words, self._interface.span, one.span)
        for name, asked in self._interface.outputs.items():
            if name not in outputs:
                return self._refusal(f"has no output `{name}`", asked.span)
            difference = _difference(outputs[name], within=asked)
            if difference is not None:
                words = f"gives an output `{name}` that is not {difference}"
                return self._refusal(words, asked.span, outputs[name].span)
        return None

    def _refusal(self, words: str, at: SourceSpan, other: SourceSpan | None = None) -> Diagnostic:
        labels = () if other is None else (SpanLabel(other, "of the provider"),)
        return Diagnostic(_CODE, f"{self._shown} {words}", SpanLabel(at, "of the interface"), labels)

    def _precondition(self) -> ActionCondition | None:
        """Return the condition under which it can start, on the state and the inputs of the interface."""
        if self._skill is None:
            span = self._composition.precondition_span
            return None if span is None else ActionCondition(self._composition.precondition, "", span)
        clause = self._skill.precondition
        if clause is None:
            return None
        defaults = {
            one.name: constant_term(one.default_value, one.variable.type)
            for name, one in self._skill.inputs.items()
            if name not in self._interface.inputs
        }
        return ActionCondition(t.substitute(clause.term, defaults), clause.text, clause.span)

    def _ready(self, required: ActionCondition, assumed: tuple[t.Term, ...]) -> Obligation:
        where, cure = "the precondition of the interface", "strengthen the precondition of the interface"
        if not assumed:
            where, cure = (
                "without a precondition, so it promises a start in every state",
                "add a `precondition`",
            )
        return Obligation(
            ClaimForm.INTERFACE_READY(*self._about),
            _CODE,
            ClaimMode.ALWAYS,
            VariableSpace(self._variables, assumed),
            required.term,
            f"{self._shown} cannot start wherever its interface says that it can",
            self._place(where),
            (SpanLabel(required.span, "may not hold then"),),
            (f"{cure}, or weaken that of the provider",),
        )

    def _achieved(self, promised: ActionCondition, start: t.Term) -> Iterator[Obligation | StaticClaim]:
        composition = replace(self._composition, precondition=start)
        try:
            paths = explore_paths(composition, self._skills, self._site.state, self._definitions)
        except TooManyPathsError:
            headline = f"{self._shown} has too many paths to explore, so its interface is not proved"
            yield StaticClaim(
                ClaimForm.INTERFACE_ACHIEVED(*self._about), Diagnostic(_CODE, headline, self._place())
            )
            return
        broken = "not so after each success of its provider"
        claim = Obligation(
            ClaimForm.INTERFACE_ACHIEVED(*self._about),
            _CODE,
            ClaimMode.ALWAYS,
            VariableSpace(self._variables, ()),
            promised.term,
            f"{self._shown} does not achieve what its interface promises",
            SpanLabel(promised.span, broken),
            (SpanLabel(self._composition.span, "provides it"),),
            ("declare the effect of its outcomes, or weaken `achieves`",),
            labelled_conjuncts=tuple(
                LabelledConjunct(part.term, SpanLabel(part.span, broken)) for part in promised.conjuncts
            ),
        )
        yield from obligation_per_situation(
            claim,
            ClaimForm.INTERFACE_ACHIEVED_CASE,
            paths.final_states,
            self._site.state,
            skills_of_steps(composition, self._skills),
        )

    def _place(self, text: str = "of this interface") -> SpanLabel:
        clause = self._interface.precondition
        return SpanLabel(self._interface.span if clause is None else clause.span, text)


def _single_step(skill: Skill) -> Composition:
    """Make a composition that runs one skill once."""
    step = Step(skill.id, skill.id, {}, {}, 0, None, STOP_ON_FAILURE, skill.span)
    handlers: Mapping[str, Step] = {}
    return Composition(skill.id, t.TRUE, None, step, handlers, skill.span)


def _difference(given: Declared, within: Declared) -> str | None:
    """Describe the values that a variable has, if some of another one are not among them; else None."""
    type_ = within.variable.type
    if given.variable.type != type_:
        return f"as {type_}, not as {given.variable.type}"
    if within.range is None:
        return None
    low, high = within.range
    if given.range is not None and low <= given.range[0] and given.range[1] <= high:
        return None
    return f"only from {format_range(within.range, within.unit)}"
