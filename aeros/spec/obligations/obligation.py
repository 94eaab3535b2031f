"""Obligations: formulas that settle a claim, with everything needed to tell a person about it.

Building a query and running a solver are two things: this package builds, `discharge` runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.expr import terms as t
from aeros.spec.model.model import ActionCondition, Conjunct, Declared, Rule
from aeros.spec.obligations.claim_id import ClaimId
from aeros.spec.obligations.verdicts import Verdict


class ClaimMode(Enum):
    """How a formula settles its claim."""

    ALWAYS = "always"  # proved iff (assumptions and not conclusion) is unsatisfiable
    SOMETIMES = "sometimes"  # proved iff (assumptions and conclusion) is satisfiable


@dataclass(frozen=True)
class VariableSpace:
    """The variables that a family of obligations ranges over, and what it assumes of them.

    Every variable is assumed to be inside its declared range: the gate denies all other values.
    """

    variables: tuple[Declared, ...]
    assumptions: tuple[t.Term, ...]

    @cached_property
    def by_name(self) -> Mapping[str, Declared]:
        """The variables by name."""
        return {one.name: one for one in self.variables}


@dataclass(frozen=True)
class LabelledConjunct:
    """A conjunct of what an obligation asks for, and what to say beside it where it is at fault."""

    term: t.Term
    label: SpanLabel


def label_conjuncts(conjuncts: Iterable[Conjunct], text: str) -> tuple[LabelledConjunct, ...]:
    """A member for each conjunct, with `text` beside it."""
    return tuple(LabelledConjunct(one.term, SpanLabel(one.span, text)) for one in conjuncts)


def rule_conjuncts(rules: Iterable[Rule], kind: str) -> tuple[LabelledConjunct, ...]:
    """The conjuncts of what `rules` require of an action of `kind`."""
    return tuple(
        member
        for rule in rules
        for member in label_conjuncts(rule.conjuncts.get(kind, ()), f"required by `{rule.id}`")
    )


@dataclass(frozen=True)
class Obligation:
    """One claim, as a formula over a space, and what to say if it fails.

    id: stable and unique in its module; its text is as in `safety/wrap/move_tool/workspace`.
    code, headline, primary, secondary, notes, help: the diagnostic of a refutation.
    failing: the verdict of a SOMETIMES claim that fails, REFUTED or VACUOUS.
    guard: the invariant that the gate may decide where this claim fails, if the manifest or the
        rule itself leaves it to the gate; None where a refutation is an error.
    members: the conjuncts of assumptions and conclusion (SOMETIMES) or of the conclusion (ALWAYS).
    clause: the envelope that is to imply the conclusion.
    primary_alone: whether a member inside the primary label is shown where it alone of those is at fault.
    """

    id: ClaimId
    code: str
    mode: ClaimMode
    space: VariableSpace
    conclusion: t.Term
    headline: str
    primary: SpanLabel
    secondary: tuple[SpanLabel, ...] = ()
    help: tuple[str, ...] = ()
    failure_verdict: Verdict = Verdict.REFUTED
    runtime_checked_rule: str | None = None
    labelled_conjuncts: tuple[LabelledConjunct, ...] = ()
    clause: ActionCondition | None = None
    notes: tuple[str, ...] = ()
    primary_alone: bool = False
