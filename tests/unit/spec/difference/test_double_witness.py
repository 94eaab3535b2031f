"""Witnesses of differences as doubles, replayed by the gates of both sides."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import Reading
from aeros.runtime.proving import prove_configuration
from aeros.skill import Action
from aeros.spec.backends.oracle import Oracle
from aeros.spec.difference.compare import compare
from aeros.spec.difference.double_witness import witness_of_doubles
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.expr.semantics import Value
from aeros.spec.verification.witness import Witness
from tests.repo.tree import ROOT

CORPUS = ROOT / "tests" / "corpus"
SITE = CORPUS / "site" / "table.yaml"


def between(low: Fraction, high: Fraction, values: Mapping[str, Value]) -> bool:
    value = values["x"]
    assert isinstance(value, Fraction)
    return low < value <= high


_TENTHS = st.integers(0, 1000).map(lambda tenths: Fraction(tenths, 10))


@given(_TENTHS, _TENTHS, st.booleans())
def test_values_on_bounds_are_moved_to_doubles_that_show_the_same(
    one: Fraction, other: Fraction, is_at_bound: bool
) -> None:
    low, high = sorted((one, other))
    if low == high:
        return
    exact = Witness((), {"x": high if is_at_bound else (low + high) / 2, "name": "a", "flag": True})
    found = witness_of_doubles(exact, lambda values: between(low, high, values))
    assert found is not None
    value = found.values["x"]
    assert isinstance(value, Fraction)
    assert low < Fraction(float(value)) <= high
    assert low < value <= high
    assert (found.values["name"], found.values["flag"]) == ("a", True)


def test_a_difference_between_two_doubles_has_no_such_witness() -> None:
    exact = Witness((), {"x": Fraction(1, 10)})
    assert witness_of_doubles(exact, lambda values: values["x"] == Fraction(1, 10)) is None


def test_every_part_of_a_position_is_moved() -> None:
    exact = Witness((), {"x": (Fraction(1, 10), Fraction(1, 10), Fraction(1, 10))})

    def below(values: Mapping[str, Value]) -> bool:
        parts = values["x"]
        assert isinstance(parts, tuple)
        return all(part <= Fraction(1, 10) for part in parts)

    found = witness_of_doubles(exact, below)
    assert found is not None
    assert below({name: tuple(map(Fraction, value)) for name, value in to_doubles(found.values).items()})


@pytest.mark.parametrize("bound", ["200.1 mm/s", "0.3 m/s", "0.7 m/s", "0.2000001 m/s"])
def test_the_gates_of_both_versions_decide_the_witness_as_the_report_says(tmp_path: Path, bound: str) -> None:
    old = CORPUS / "accepted" / "left_to_the_gate"
    new = shutil.copytree(old, tmp_path / "left_to_the_gate")
    manifest = new / "ecm.yaml"
    text = manifest.read_text().replace("pace <= 200 mm/s", f"pace <= {bound}")
    manifest.write_text(text)
    difference = compare(old, new, SITE, Oracle(), {})
    (witness,) = (one for change in difference.changes for one in change.witnesses.values())
    values = to_doubles(witness.values)
    kinds = []
    for module in (old, new):
        configuration, _ = prove_configuration([module], SITE, certified=False)
        gate = CompiledGate(configuration, GateMode.CHECKED)
        state = {
            name: Reading(values[name], 10.0)
            for name in configuration.site.observed_variables
            if name in values
        }
        caller = Caller("left_to_the_gate", "tidy", {})
        usage = {quota.id: 0 for quota in configuration.site.quotas}
        decision = gate.decide(caller, state, Action("approach", {"pace": values["pace"]}), 10.0, usage)
        kinds.append((decision.kind, {reason.code for reason in decision.reasons}))
    assert "AE730" in kinds[0][1]
    assert "AE730" not in kinds[1][1]
    assert kinds[0][0] is DecisionKind.DENY
