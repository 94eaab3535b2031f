"""Decisions of the gate: their kinds are compared and never taken for true or false."""

from __future__ import annotations

import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind


@pytest.mark.parametrize("kind", DecisionKind)
def test_a_kind_of_decision_has_no_truth_value(kind: DecisionKind) -> None:
    with pytest.raises(TypeError, match="compare it"):
        bool(kind)
    with pytest.raises(TypeError, match="compare it"):
        _ = Decision(kind, None, ()).kind and "allowed"


def test_kinds_are_written_in_records_by_their_names() -> None:
    assert [kind.value for kind in DecisionKind] == ["ALLOW", "ATTENUATE", "DENY"]
    assert DecisionKind("DENY") is DecisionKind.DENY
