"""Values that a module gives to variables: of the right type, and inside the range."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_module


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ("dirt: 100 %, table_tidy: true", None),
        ("dirt: 101 %", "error[AE111] out-of-bounds: this value is outside the declared range"),
        ("dirt: 1 m", "error[AE204] unit-mismatch: expected real [1], found real [m]"),
        ("table_tidied: true", "`table_tidied` is neither a state variable of this site nor a need"),
        ("load: 2 * slow", "error[AE204] unit-mismatch: expected real [kg], found real [m/s]"),
    ],
)
def test_the_value_of_a_state_variable_fits_its_declaration(
    tmp_path: Path, effects: str, message: str | None
) -> None:
    found = messages_of_module(tmp_path, ("effects: {table_tidy: true}", f"effects: {{{effects}}}"))
    assert found == [] if message is None else message in found[0]
