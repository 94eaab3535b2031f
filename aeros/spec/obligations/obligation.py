"""Obligations: formulas that settle a claim, with the text of the report if the claim fails.

This package builds the formulas; `aeros.spec.verification.discharge` runs the solver.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.rules import Conjunct, Rule
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimId
from aeros.spec.obligations.verdicts import Verdict


class ClaimMode(Enum):
    """The two ways in which a formula settles its claim: it always holds, or it sometimes holds."""

    ALWAYS = "always"  # proved iff (assumptions and not conclusion) is unsatisfiable
    SOMETIMES = "sometimes"  # proved iff (assumptions and conclusion) is satisfiable


@dataclass(frozen=True)
class VariableSpace:
    """The variables that a family of obligations ranges over, and the assumptions about them.

    Every variable is assumed to be inside its declared range: the gate denies all other values.

    Attributes:
        variables: the variables with their ranges.
        assumptions: conditions assumed to hold.
    """

    variables: tuple[Declared, ...]
    assumptions: tuple[t.Term, ...]

    @cached_property
    def by_name(self) -> Mapping[str, Declared]:
        """The variables by name."""
        return {one.name: one for one in self.variables}


@dataclass(frozen=True)
class LabelledConjunct:
    """A conjunct of an obligation's formula, and the label to show if it is at fault.

    Attributes:
        term: the conjunct.
        label: place and text to show if it is at fault.
    """

    term: t.Term
    label: SpanLabel


def label_conjuncts(conjuncts: Iterable[Conjunct], text: str) -> tuple[LabelledConjunct, ...]:
    """Attach one text to each conjunct.

    Args:
        conjuncts: conjuncts with their positions.
        text: text of each label.

    Returns:
        A labelled conjunct for each.
    """
    return tuple(LabelledConjunct(one.term, SpanLabel(one.span, text)) for one in conjuncts)


def rule_conjuncts(rules: Iterable[Rule], kind: str) -> tuple[LabelledConjunct, ...]:
    """List the conjuncts of rules for one action kind, each labelled with its rule.

    Args:
        rules: rules of a site.
        kind: the action kind.

    Returns:
        The conjuncts; none of a rule that does not govern the kind.
    """
    return tuple(
        member
        for rule in rules
        for member in label_conjuncts(rule.conjuncts.get(kind, ()), f"required by `{rule.id}`")
    )


@dataclass(frozen=True)
class Obligation:
    """One claim, as a formula over a space, and the diagnostic of its refutation.

    Attributes:
        id: identity, stable and unique in its module; its text is like `safety/wrap/move_tool/workspace`.
        code: code of the diagnostic.
        mode: ALWAYS if the formula has to hold in the whole space, SOMETIMES if somewhere in it.
        space: variables and assumptions.
        conclusion: the formula.
        headline: headline of the diagnostic.
        primary: main label of the diagnostic.
        secondary: further labels of the diagnostic.
        help: remedies that the diagnostic offers.
        failure_verdict: the verdict of a SOMETIMES claim that fails, REFUTED or VACUOUS.
        runtime_checked_rule: the invariant that the gate may decide where this claim fails, if the manifest
            or the rule itself leaves it to the gate; None where a refutation is an error.
        labelled_conjuncts: conjuncts of assumptions and conclusion (SOMETIMES) or of the conclusion (ALWAYS).
        clause: the envelope that should imply the conclusion.
        notes: notes of the diagnostic.
        primary_alone: True if a conjunct inside the primary label is shown only where it is the single one of
            those at fault.
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
