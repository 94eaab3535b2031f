"""A goal given as an argument: a condition over the site's vocabulary."""

from __future__ import annotations

from aeros.spec.diagnostics import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_condition
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.located import Expression
from aeros.spec.model import Clause, Site
from aeros.spec.nodes import ScalarNode
from aeros.spec.source import Source


def goal_of(text: str, site: Site) -> Clause:
    """The condition that `text` is; raises `UserError` with the place of what is wrong with it."""
    sink = Diagnostics()
    span = Source("--goal", text).span(0, len(text))
    found = elaborate_condition(Expression(text, span, ScalarNode(text, span)), state_scope(site), sink)
    sink.raise_if_errors()
    assert found is not None
    return Clause(found.term, text, span, found.conjuncts)
