"""Parts under `hold` and `timeout` are read with their condition or time, and faults are at their place."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.composition import Part
from aeros.spec.model.step_graph import HeldPart, RetriedPart, TimedPart, steps_of

CORPUS = Path(__file__).parents[4] / "corpus"
CASE = CORPUS / "rejected" / "composition" / "held_part_of_which_nothing_is_said"
OLD = "      hold: fetched == brush\n      part: {skill: sweep, on_failure: stop}\n"


def elaborated(folder: Path, do: str) -> tuple[Part | None, list[tuple[str, str]]]:
    """Elaborate a composition whose `do` is given; return its body and the faults with the text they mark."""
    text = (CASE / "ecm.yaml").read_text()
    assert text.count(OLD) == 1
    (folder / "ecm.yaml").write_text(text.replace(OLD, f"      {do}\n"))
    (folder / "skills.py").write_text((CASE / "skills.py").read_text())
    sink = Diagnostics()
    site = load_site(CORPUS / "site" / "table.yaml", sink)
    assert site is not None
    loaded = load_ecm(folder, site, sink)
    faults = [(one.code, "" if one.primary is None else one.primary.span.text) for one in sink]
    composition = None if loaded is None else loaded.ecm.compositions.get("composed")
    return (None if composition is None else composition.body), faults


def test_a_condition_is_held_with_its_text_and_conjuncts(tmp_path: Path) -> None:
    body, faults = elaborated(
        tmp_path, "{hold: table_tidy and dirt < 5 %, part: {skill: sweep}, on_failure: stop}"
    )
    assert faults == []
    assert isinstance(body, HeldPart)
    assert (body.condition.text, body.stops_composition) == ("table_tidy and dirt < 5 %", True)
    assert [one.span.text for one in body.condition.conjuncts] == ["table_tidy", "dirt < 5 %"]
    steps: list[Any] = list(steps_of(body))
    assert [one.id for one in steps] == ["sweep"]


def test_a_time_is_read_in_its_unit_and_tries_are_around_it(tmp_path: Path) -> None:
    body, faults = elaborated(tmp_path, "{timeout: 1500 ms, retry: 1, part: {skill: sweep}}")
    assert faults == []
    assert isinstance(body, RetriedPart)
    assert isinstance(body.part, TimedPart)
    assert (body.part.timeout, body.part.stops_composition) == (Fraction(3, 2), False)


@pytest.mark.parametrize(
    ("do", "faults"),
    [
        ("{hold: table_tidy}", [("AE102", "{hold: table_tidy}")]),
        ("{timeout: 5 s}", [("AE102", "{timeout: 5 s}")]),
        ("{timeout: 0 s, part: {skill: sweep}}", [("AE129", "0 s")]),
        ("{timeout: 5 m, part: {skill: sweep}}", [("AE204", "5 m")]),
        ("{hold: nowhere, part: {skill: sweep}}", [("AE202", "nowhere")]),
        ("{hold: dirt, part: {skill: sweep}}", [("AE203", "dirt")]),
        ("{hold: table_tidy, part: {check: table_tidy}}", [("AE112", None), ("AE112", None)]),
        ("{hold: table_tidy, part: {skill: sweep}, on_failure: sweep}", [("AE102", "sweep")]),
        (
            "{tolerate: {hold: table_tidy, part: {skill: sweep}, on_failure: stop}}",
            [("AE102", "stop")],
        ),
        ("{hold: table_tidy, timeout: 5 s, part: {skill: sweep}}", [("AE102", None)]),
        ("{skill: sweep, part: {skill: sweep}}", [("AE102", None), ("AE120", None)]),
    ],
)
def test_faults_are_reported_at_their_place(
    tmp_path: Path, do: str, faults: list[tuple[str, str | None]]
) -> None:
    body, found = elaborated(tmp_path, do)
    assert body is None
    assert [code for code, _ in found] == [code for code, _ in faults]
    for (_, marked), (_, expected) in zip(found, faults, strict=True):
        assert expected is None or marked == expected
