"""Composition graphs, resolved: steps over a module's skills, in sequence, in parallel, by condition.

Put together of `parts`.  A step runs its skill.  After a failure outcome its handler runs, if it has one,
and it is tried again while `retry` lasts; then, or when the handler fails for good, the whole composition
stops as failed.  `par` succeeds when all its branches have.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model import step_graph

STOP_ON_FAILURE = "stop"
"""As `on_failure`: the composition stops as failed, and says so."""


@dataclass(frozen=True)
class OutputReference:
    """The output of an earlier step that an input takes."""

    step: str
    output: str
    span: SourceSpan


@dataclass(frozen=True)
class Step:
    """One invocation of a skill, in a body or as a handler.

    inputs: constants in SI, defaults included.
    on_failure: the handler run between two tries, `STOP_ON_FAILURE`, or None where nothing is said.
    """

    id: str
    skill: str
    inputs: Mapping[str, Any]
    output_references: Mapping[str, OutputReference]
    retry: int
    on_failure: str | None
    span: SourceSpan

    @property
    def handler(self) -> str | None:
        """The name of its handler, if it has one."""
        return None if self.on_failure == STOP_ON_FAILURE else self.on_failure


Part: TypeAlias = step_graph.Part[Step]


@dataclass(frozen=True)
class Composition:
    """A named graph, and what must be measured before it starts.

    precondition_span: None where there is no precondition.
    handlers: by name; a skill named under `on_failure` is a handler of that name.
    """

    id: str
    precondition: t.Term
    precondition_span: SourceSpan | None
    body: Part
    handlers: Mapping[str, Step]
    span: SourceSpan


def handlers_of(step: Step, handlers: Mapping[str, Step]) -> Iterator[Step]:
    """Every handler that a failure of `step` may lead to, each once."""
    seen: set[str] = set()
    name = step.handler
    while name is not None and name not in seen:
        seen.add(name)
        yield handlers[name]
        name = handlers[name].handler
