"""Data that flows between steps is there, and fits."""

from __future__ import annotations

import pytest

from aeros.spec.obligations.data_flow import data_obligations
from tests.unit.spec.obligations.data.tidier import Change, compare_reports, failed, module

SPEND = "{skill: spend, inputs: {gain: {from: weigh.amount}}}"
STEPS = f"        - {{skill: weigh}}\n        - {SPEND}\n"
AMOUNT = "amount: {type: real, unit: mm, range: [0, 1000]}"


def faults(*changes: Change) -> dict[str, str]:
    ecm = module(*changes)
    claims = list(data_obligations(ecm.compositions["clean"], ecm.skills))
    compare_reports("data_flow_reports.txt", changes, claims)
    found = failed(claims)
    return {name.removeprefix("composition/clean/"): code for name, code in found.items()}


def test_an_output_of_an_earlier_step_in_its_whole_range_fits() -> None:
    assert faults() == {}
    ecm = module()
    names = [str(one.id) for one in data_obligations(ecm.compositions["clean"], ecm.skills)]
    assert names == ["composition/clean/spend/gain/there", "composition/clean/spend/gain/fits"]
    assert list(data_obligations(ecm.compositions["both"], ecm.skills)) == []


@pytest.mark.parametrize(
    ("steps", "is_there"),
    [
        (["{skill: weigh}", SPEND], True),
        ([SPEND, "{skill: weigh}"], False),
        ([f"{{seq: [{{skill: weigh}}, {SPEND}]}}"], True),
        (["{if: table_tidy, then: {skill: weigh}, else: nothing}", SPEND], False),
        (["{if: table_tidy, then: {skill: weigh}}", SPEND], True),
        (["{if: table_tidy, then: {skill: roll}, else: {skill: weigh}}", SPEND], False),
        ([f"{{if: table_tidy, then: {{seq: [{{skill: weigh}}, {SPEND}]}}, else: nothing}}"], True),
        (["{par: [{skill: roll}, {skill: weigh}]}", SPEND], True),
        ([f"{{par: [{SPEND}, {{skill: weigh}}]}}"], False),
        (["{skill: weigh}", f"{{par: [{SPEND}, {{skill: roll}}]}}"], True),
    ],
)
def test_an_output_is_there_if_its_step_has_succeeded_on_every_path(steps: list[str], is_there: bool) -> None:
    lines = "".join(f"        - {one}\n" for one in steps)
    assert faults((STEPS, lines)) == ({} if is_there else {"spend/gain/there": "AE853"})


@pytest.mark.parametrize(
    ("output", "fits"),
    [
        ("amount: {type: real, unit: m, range: [0, 1]}", True),
        ("amount: {type: real, unit: cm, range: [10, 90]}", True),
        ("amount: {type: real, unit: mm, range: [0, 1001]}", False),
        ("amount: {type: real, unit: mm, range: [-1, 1000]}", False),
        ("amount: {type: real, unit: s, range: [0, 1]}", False),
        ("amount: {type: bool}", False),
    ],
)
def test_an_output_fits_if_the_input_admits_its_whole_range(output: str, fits: bool) -> None:
    assert faults((AMOUNT, output)) == ({} if fits else {"spend/gain/fits": "AE852"})


def test_ranges_that_do_not_fit_are_shown_in_their_own_units() -> None:
    ecm = module((AMOUNT, "amount: {type: real, unit: mm, range: [0, 1500]}"))
    *_, claim = data_obligations(ecm.compositions["clean"], ecm.skills)
    assert claim.diagnostic is not None
    assert [one.text for one in claim.diagnostic.secondary] == ["0 to 1500 mm", "0 to 1 m"]


def test_a_bare_number_is_shown_without_a_unit() -> None:
    gain = "gain: {type: real, unit: m, range: [0, 1]}"
    ecm = module(
        (AMOUNT, 'amount: {type: real, unit: "1", range: [0, 2]}'),
        (gain, 'gain: {type: real, unit: "1", range: [0, 1]}'),
        ("precondition: inputs.gain <= 1 m", "precondition: inputs.gain <= 1"),
    )
    *_, claim = data_obligations(ecm.compositions["clean"], ecm.skills)
    assert claim.diagnostic is not None
    assert [one.text for one in claim.diagnostic.secondary] == ["0 to 2", "0 to 1"]


def test_values_without_a_range_fit_if_their_types_are_equal() -> None:
    truth = (
        (AMOUNT, "amount: {type: bool}"),
        ("gain: {type: real, unit: m, range: [0, 1]}", "gain: {type: bool}"),
    )
    assert faults(*truth, ("precondition: inputs.gain <= 1 m", "precondition: inputs.gain")) == {}
