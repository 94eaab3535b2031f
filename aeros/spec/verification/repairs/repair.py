"""Repair of envelopes that allow too much: the line with the least edit, proved before it is offered.

One line for each envelope repairs everything in it that can be repaired, so that two repairs of the same line
never contradict each other.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostic, Fix
from aeros.spec.elaborate.scopes import scope_over
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.obligation import ClaimMode, Obligation
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from aeros.spec.verification.repairs.edits import ConditionEditor
from aeros.spec.verification.repairs.source_edit import AMBIGUOUS, edit_in_source


@dataclass(frozen=True)
class Repair:
    """Proved repair of a refuted obligation.

    Attributes:
        line: the line to write, for people, or a sentence that begins with `remove`.
        fix: the same as an edit of the file; None if the edit is not known.
    """

    line: str
    fix: Fix | None


BACKTICKED: Final = re.compile(r"`([^`]+)`")
"""Names in a message."""

Candidates = Iterator[tuple[str, Fix | None]]
"""Lines to write, for people, each with its edit; the smallest change first."""


@dataclass(frozen=True)
class FailedClaim:
    """A claim without a repair.

    Attributes:
        id: its identity.
        diagnostic: report of the failure.
    """

    id: ClaimId
    diagnostic: Diagnostic


def advice(line: str) -> str:
    """Return what a person is to do for a repair.

    Args:
        line: the line of a repair.

    Returns:
        A remedy, as diagnostics show it.
    """
    return line if line.startswith("remove ") else f"write `{line}`"


def find_repairs(
    findings: Iterable[ObligationResult], site: Site, oracle: Oracle, readable: frozenset[str] = frozenset()
) -> Mapping[ClaimId, Repair]:
    """Find the repaired line for each refuted obligation of an envelope.

    Args:
        findings: results of obligations.
        site: the site.
        oracle: solver with its budget.
        readable: names of the state variables that a repaired line may read.

    Returns:
        The repair by the id of each refuted obligation that it repairs.
    """
    known = {finding.obligation.id: finding for finding in findings}
    failing: dict[tuple[str, str], list[Obligation]] = {}
    for finding in known.values():
        one = finding.obligation
        refuted = finding.verdict is Verdict.REFUTED and not finding.is_runtime_checked
        if refuted and one.mode is ClaimMode.ALWAYS and one.clause is not None:
            envelope = one.id.name_of("skill"), one.id.name_of("action")
            failing.setdefault(envelope, []).append(one)
    repairs: dict[ClaimId, Repair] = {}
    for (skill, kind), obligations in failing.items():
        not_dead = known.get(ClaimForm.ENVELOPE_NOT_DEAD(skill, kind))
        clause = obligations[0].clause
        if clause is None or not_dead is None or not_dead.verdict is not Verdict.PROVED:
            continue
        declared = obligations[0].space.variables
        scope = scope_over(site, declared)
        editor = ConditionEditor(scope, declared, oracle.with_reduced_budget(50), readable)
        repaired = _repair_clause(clause, obligations, not_dead.obligation, editor, oracle)
        if repaired is not None:
            text, done = repaired
            line = f"{clause.kind_name or kind}: {_quoted(' '.join(text.split()), clause)}"
            repairs |= {one.id: Repair(line, edit_in_source(clause.span, clause.text, text)) for one in done}
    return repairs


def _repair_clause(
    clause: ActionCondition,
    obligations: list[Obligation],
    not_dead: Obligation,
    editor: ConditionEditor,
    oracle: Oracle,
) -> tuple[str, list[Obligation]] | None:
    """Return the text with the edits that repair obligations, and these obligations; all of it proved."""
    text = clause.text
    repaired: list[Obligation] = []
    for one in obligations:
        edited = _strengthen_clause(editor, text, one)
        if edited is not None:
            text, repaired = edited, [*repaired, one]
    term = editor.term(text)
    if not repaired or term is None:
        return None
    results = discharge_obligations((_with_envelope(one, term) for one in (*repaired, not_dead)), oracle)
    return (text, repaired) if all(one.verdict is Verdict.PROVED for one in results) else None


def _with_envelope(obligation: Obligation, envelope: t.Term) -> Obligation:
    """Return the same obligation for another envelope."""
    return replace(obligation, space=replace(obligation.space, assumptions=(envelope,)))


def _strengthen_clause(editor: ConditionEditor, text: str, obligation: Obligation) -> str | None:
    """Edit `text` for each conjunct of the conclusion that it does not imply."""
    edited: str | None = text
    for goal in obligation.labelled_conjuncts:
        if edited is None or editor.implies(edited, goal.term):
            continue
        try:
            edited = editor.strengthen(edited, goal.term, _unquoted(goal.label.span.text))
        except ExpressionSyntaxError:  # the text of a conjunct over several lines of a block may not parse
            return None
    return edited if obligation.labelled_conjuncts else None


def _unquoted(written: str) -> str:
    text = " ".join(written.split())
    return text[1:-1] if text[:1] in ("'", '"') else text


def _quoted(text: str, clause: ActionCondition) -> str:
    """Quote the text as it is to be written: where the author has quotes or YAML needs them."""
    quote = clause.span.text[:1]
    if quote in ("'", '"'):
        return f"{quote}{text}{quote}"
    return f'"{text}"' if AMBIGUOUS.search(text) and not AMBIGUOUS.search(clause.text) else text
