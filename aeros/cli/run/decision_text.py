"""Decisions and their explanations as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from aeros.cli.terminal.rendering import table_lines
from aeros.runtime.gate.decision import Decision
from aeros.runtime.gate.explain import EvaluatedCondition, Explanation


def decision_text(decision: Decision) -> str:
    """Format a decision: verdict, permitted action, and every reason.

    Args:
        decision: The decision.

    Returns:
        Lines of text.
    """
    return "\n".join(_decision_lines(decision))


def explanation_text(explanation: Explanation, width: int | None) -> str:
    """Format an explanation: decision, layers, and each condition with its proof or values.

    Args:
        explanation: The explanation.
        width: Columns of the terminal, into which tables are fitted; None for no limit.

    Returns:
        Lines of text that end with a blank line.
    """
    lines = [*_decision_lines(explanation.decision), *_layer_lines(explanation)]
    lines += _clause_lines(explanation.conditions, width)
    if explanation.attenuated_parameters:
        lines += ["  re-decided after attenuation", *_clause_lines(explanation.attenuated_parameters, width)]
    return "\n".join([*lines, ""])


def _decision_lines(decision: Decision) -> Iterator[str]:
    action = decision.action
    if action is None:
        yield decision.kind.value
    else:
        parameters = ", ".join(f"{name}={value}" for name, value in action.parameters.items())
        yield f"{decision.kind.value} {action.kind}({parameters})"
    for reason in decision.reasons:
        yield f"  {reason.code} {reason.rule}: {reason.text}"


def _layer_lines(explanation: Explanation) -> Iterator[str]:
    for label, wanted in (("passed", True), ("not passed", False), ("not known", None)):
        names = [name for name, passed in explanation.layers.items() if passed is wanted]
        if names:
            yield f"  {label}: {'; '.join(names)}"


def _clause_lines(clauses: Sequence[EvaluatedCondition], width: int | None) -> Iterator[str]:
    proved = [one for one in clauses if one.obligation and one.holds is None and not one.missing]
    name_columns = max((len(one.name) for one in clauses), default=0)  # the same in both tables
    if proved:
        yield "  proved at installation"
        rows = [(one.name, f"by {one.obligation}") for one in proved]
        yield from table_lines(rows, width=width, indent=4, least=(name_columns,))
    rest = [one for one in clauses if one not in proved]
    if rest:
        yield "  runtime-checked"
        results = [(one.name, _RESULTS[one.holds], f"{one.text}{_at(one)}") for one in rest]
        least = (name_columns, max(map(len, _RESULTS.values())))
        yield from table_lines(results, width=width, indent=4, least=least)


_RESULTS: Final = {True: "holds", False: "fails", None: "unknown"}


def _at(clause: EvaluatedCondition) -> str:
    parts = [", ".join(f"{name} = {value}" for name, value in clause.values.items())]
    parts += [f"no value of {', '.join(clause.missing)}"] if clause.missing else []
    parts += [f"proved by {clause.obligation}"] if clause.obligation else []
    text = "; ".join(part for part in parts if part)
    return f"  [{text}]" if text else ""
