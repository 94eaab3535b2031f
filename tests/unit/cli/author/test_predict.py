"""`aeros predict`: exact numbers for the reference modules, and every refusal."""

from __future__ import annotations

import json
from decimal import ROUND_CEILING, ROUND_FLOOR
from fractions import Fraction
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from aeros.agent.identity import Identity
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory
from aeros.cli.author.module_argument import read_module
from aeros.cli.author.predict import _number
from aeros.cli.main import main
from aeros.exit_codes import Exit

ROOT = Path(__file__).parents[4]
CORPUS = ROOT / "tests" / "corpus"
CLEAN, DUMPLINGS = str(ROOT / "ecms" / "clean_table"), str(ROOT / "ecms" / "make_dumplings")
SURE = ("--probability", "organize.left_over=0", "--probability", "verify.verified=1")
"""Skills after wiping never fail."""


def predictions(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["predict", *arguments, "--format", "json"]) == Exit.SUCCESS
    shown = json.loads(capsys.readouterr().out)
    assert shown["schema"] == "aeros/prediction/1"
    (one,) = shown["predictions"]
    return dict(one)


def test_the_text_says_what_was_asked_and_what_comes_of_it(capsys: pytest.CaptureFixture[str]) -> None:
    certain = ["--probability", "wipe.wiped=70%", *SURE]
    assert main(["predict", CLEAN, *certain, "--max-replans", "0"]) == Exit.SUCCESS
    assert capsys.readouterr().out.splitlines() == [
        "clean_table.clean_table at panda_cell, at most 0 re-plans",
        "from clean_table.clutter_missing = false, "
        "clean_table.clutter_on_table = true, clean_table.clutter_ungraspable = false, "
        "clean_table.overhead_off = false, "
        "clean_table.rest_blocked = false, clean_table.robot_at_table = true, "
        "clean_table.sponge_missing = false, "
        "clean_table.sponge_overturned = false, "
        "clean_table.sponge_seen = true, "
        "clean_table.table_organized = false, clean_table.table_verified = false, "
        "clean_table.table_wiped = false, clean_table.wiping_area_clear = true",
        "success probability     0.91   = 91/100",
        "failure probability     0.09   = 9/100",
        "expected invocations    3.21   = 321/100",
        "  of these, retries     0.3    = 3/10",
        "  of these, recoveries  0.09   = 9/100",
        "expected re-plans       0      = 0",
        "expected time, s        72.46  = 3623/50",
    ]


def test_json_has_exact_fractions_and_the_start(capsys: pytest.CaptureFixture[str]) -> None:
    found = predictions(capsys, CLEAN, "--probability", "wipe.streaky=3/10", *SURE, "--max-replans=1")
    assert found["module"] == found["task"] == "clean_table"
    assert found["replans_at_most"] == 1
    assert found["start"]["clean_table.clutter_on_table"] is True
    assert found["success"] == {"exact": "9919/10000", "decimal": 0.9919}
    assert Fraction(found["replans"]["exact"]) == Fraction(9, 100)


@pytest.mark.parametrize(("tries", "exact"), [(0, "7/10"), (2, "973/1000"), (3, "9919/10000")])
def test_a_retry_budget_can_be_asked_for(tries: int, exact: str, capsys: pytest.CaptureFixture[str]) -> None:
    chances = ("--probability", "wipe.wiped=0.7", *SURE)
    found = predictions(capsys, CLEAN, *chances, "--max-replans=0", f"--max-retries=wipe={tries}")
    assert found["success"]["exact"] == exact


def test_fractions_longer_than_python_writes_are_written() -> None:
    found = _number(Fraction(1, 3**10_000))
    assert len(found["exact"]) > 4_300
    assert found["decimal"] == 0.0


def test_a_skill_that_fails_more_often_than_declared_is_given_up(capsys: pytest.CaptureFixture[str]) -> None:
    chances = ("--probability", "wipe.wiped=0.1", *SURE)
    # `wipe` declares 5 % of failures, of which six in a row are no chance.
    assert Fraction(predictions(capsys, CLEAN, *chances)["failure"]["exact"]) == Fraction(9, 10) ** 6


@pytest.mark.parametrize(
    "arguments",
    [
        ["--probability", "wrap=0.7"],
        ["--probability", "wrap.wrapped=1e-999999999"],
        ["--probability", "wrap.wrapped=1.5"],
        ["--probability", "wrap.wrapped=1/0"],
        ["--probability", "wrap.wrapped=-1"],
        ["--max-retries", "wrap"],
        ["--max-retries", "wrap=many"],
        ["--max-replans", "-1"],
    ],
)
def test_malformed_arguments_are_usage_errors(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["predict", DUMPLINGS, *arguments])
    assert ended.value.code == Exit.USAGE
    assert "error: argument" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ([str(ROOT / "ecms")], "holds several modules; name one"),
        ([DUMPLINGS, "--task", "bake"], "has no task `bake`; it has make_dumplings"),
        ([DUMPLINGS, "--probability", "fry.done=1"], "has no skill `fry`"),
        ([DUMPLINGS, "--probability", "wrap.done=1"], "`wrap` has no outcome `done`"),
        (
            [DUMPLINGS, "--probability", "wrap.wrapped=1", "--probability", "wrap.spoilt=1"],
            "are not a distribution",
        ),
        ([DUMPLINGS, "--max-retries", "wrap=4"], "`--max-retries wrap=4`: panda_cell allows at most 3"),
        ([DUMPLINGS, "--max-retries", "fry=1"], "no rule of `make_dumplings` runs `fry`"),
    ],
)
def test_a_name_that_the_module_lacks_is_a_usage_error(
    arguments: list[str], why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["predict", *arguments]) == Exit.USAGE
    assert why in capsys.readouterr().err


@pytest.mark.parametrize(
    ("module", "code"),
    [
        ("rejected/closed_loop/rules_over_two_angles", "AE803"),
        ("rejected/form/unknown_invariant_left_to_the_gate", "AE122"),
    ],
)
def test_unpredictable_cases_are_refused(module: str, code: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["predict", str(CORPUS / module), "--site", str(CORPUS / "site" / "table.yaml")]
    assert main(arguments) == Exit.REJECTED
    assert code in capsys.readouterr().err


def test_remembered_outcomes_take_the_place_of_declared_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ecm, _ = read_module(Path(CLEAN), (), None, {})
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "panda", "", 1), "symbolic") as memory:
        start = EpisodeStart("t.t", "clean_table", "wipe", "step", {}, 0.0, {}, "{}", ecm.behaviour_digest)
        for _ in range(60):
            ending = EpisodeEnd("finished", "streaky", True, "", 9.0, {}, counts_toward_record=True)
            memory.end_episode(memory.start_episode(start), ending)
    declared = predictions(capsys, CLEAN, "--max-replans=0")
    remembered = ("--max-replans=0", "--from-memory", str(tmp_path))
    # On physics nothing is remembered.
    assert predictions(capsys, CLEAN, *remembered)["success"] == declared["success"]
    there = predictions(capsys, CLEAN, *remembered, "--plant", "symbolic")
    assert there["success"]["decimal"] < 0.8 < declared["success"]["decimal"]
    # A streaky wipe of 33 s took 9 s.
    assert predictions(capsys, CLEAN, *remembered)["seconds"] == declared["seconds"]
    assert there["seconds"]["decimal"] < declared["seconds"]["decimal"]


def test_there_is_no_expected_time_where_a_composition_may_run(capsys: pytest.CaptureFixture[str]) -> None:
    serve = predictions(capsys, str(ROOT / "ecms" / "serve_table"), "--ecms", str(ROOT / "ecms"))
    assert "invocations" in serve
    assert "seconds" not in serve


def test_a_folder_without_memory_is_a_usage_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["predict", CLEAN, "--from-memory", str(tmp_path)]) == Exit.USAGE
    assert "nothing is remembered here" in capsys.readouterr().err


@pytest.mark.parametrize(("value", "low", "high"), [("1/3", 0.333333333333, 0.333333333334), ("1", 1.0, 1.0)])
def test_bounds_are_rounded_away_from_the_value(value: str, low: float, high: float) -> None:
    number = Fraction(value)
    assert _number(number, ROUND_FLOOR)["decimal"] == low
    assert _number(number, ROUND_CEILING)["decimal"] == high
    nearly = 1 - Fraction(1, 10**70)
    assert _number(nearly, ROUND_FLOOR)["decimal"] < 1
    assert _number(1 - nearly, ROUND_CEILING)["decimal"] > 0
