"""`aeros experiment`: what it lists, runs, leaves and refuses."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import aeros.experiments
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.experiments.trial_store import TRIALS_FILE
from tests.unit.experiments.support.common import groups, marks

ECMS = str(Path(__file__).parents[4] / "ecms")
ONE = "4/flat/fetch_object"


def run(out: Path, *arguments: str) -> int:
    common = ("--plant", "symbolic", "--trials", "4", "--workers", "1", "--ecms", ECMS)
    return main(["experiment", *common, "--out", str(out), *arguments])


def test_the_list_has_every_condition_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["experiment", "list"]) == Exit.SUCCESS
    lines = capsys.readouterr().out.splitlines()
    assert "4  Comparison with published baselines" in lines
    assert [line.split()[0] for line in lines if line.startswith("    8/aeros/clean_table/0.9")] == [
        "8/aeros/clean_table/0.90"
    ]


def test_a_run_leaves_trials_and_reports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(tmp_path, ONE) == Exit.SUCCESS
    assert {path.name for path in tmp_path.iterdir()} == {
        "figures",
        "report.html",
        "report.md",
        "results.json",
        TRIALS_FILE,
    }
    message = capsys.readouterr().out
    assert "1 conditions, 1 of them different, 4 trials of each" in message
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    (row,) = results["experiments"][0]["rows"]
    assert row["rerun"].startswith(f"aeros experiment {ONE} --plant symbolic --trials 4")


@pytest.mark.physics
def test_adversaries_are_tried_on_physics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    row = "9/wide_envelope"
    assert run(tmp_path, "--plant", "physics", "--trials", "1", row) == Exit.SUCCESS
    assert "0 with intervals that exclude the exact value" in capsys.readouterr().out
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    assert [found["cells"]["violated"]["measured"] for found in one["rows"]] == [100.0, 0.0, 0.0]
    assert [found["told"] for found in one["rows"]] == [[], ["AE750 cell-speed"], ["AE501"]]


@pytest.mark.deep
def test_sessions_are_reported_in_turn(tmp_path: Path) -> None:
    assert run(tmp_path, "--trials", "1", "11/once") == Exit.SUCCESS
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    assert [row["id"] for row in one["rows"]] == ["11/once/on", "11/once/off"]
    assert all(len(row["series"]["success"]["measured"]) == 50 for row in one["rows"])
    assert (tmp_path / "figures" / "experiment-11.svg").is_file()


def test_scale_is_measured_on_every_plant(tmp_path: Path) -> None:
    assert run(tmp_path, "--plant", "physics", "--trials", "1", "10/1") == Exit.SUCCESS
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    (row,) = one["rows"]
    assert row["cells"]["found"]["measured"] == 100.0
    assert row["cells"]["installing_s"]["measured"] > 0


def test_existing_trials_are_reused_only_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(tmp_path, ONE) == Exit.SUCCESS
    before = (tmp_path / TRIALS_FILE).read_bytes()
    assert run(tmp_path, ONE) == Exit.USAGE
    assert "continue with --resume" in capsys.readouterr().err
    assert run(tmp_path, "--resume", "--trials", "5", ONE) == Exit.SUCCESS
    after = (tmp_path / TRIALS_FILE).read_bytes()
    assert after.startswith(before)
    assert after.count(b"\n") == 5


@pytest.mark.deep
def test_correlated_failures_are_compared_with_independent_ones(tmp_path: Path) -> None:
    assert run(tmp_path, "13/behaviour_tree") == Exit.SUCCESS
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    cells = {row["id"]: row["cells"]["success"] for row in one["rows"]}
    assert cells["13/behaviour_tree/make_dumplings/8"]["exact"] == pytest.approx(100 - 30 * (7 / 8) ** 2)
    assert {cell["independent"] > cell["exact"] for cell in cells.values()} == {True}
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "success, %: if independent | success, %: exact | success, %: measured" in report
    drawn = (tmp_path / "figures" / "experiment-13.svg").read_text(encoding="utf-8")
    assert len(groups(drawn, "exact")) == len(groups(drawn, "independent")) == 1
    assert "exact if attempts were independent" in drawn


@pytest.mark.parametrize("condition", ["8/flat/fetch_object/0.10", "13/flat/fetch_object/8"])
def test_one_condition_of_what_is_varied_has_a_figure_of_its_own(tmp_path: Path, condition: str) -> None:
    assert run(tmp_path, condition) == Exit.SUCCESS
    number = condition.partition("/")[0]
    drawn = (tmp_path / "figures" / f"experiment-{number}.svg").read_text(encoding="utf-8")
    assert len(marks(drawn, "measured")) == 1


@pytest.mark.deep  # tests/unit/apps/watchdog/test_watchdog.py kills the same processes
def test_kills_are_tried_on_real_processes(tmp_path: Path) -> None:
    options = ("--trials", "1", "--workers", "1", "--ecms", ECMS, "--out", str(tmp_path))
    assert main(["experiment", "12/agent", *options]) == Exit.SUCCESS
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    cells = one["rows"][0]["cells"]
    assert [cells[name]["measured"] for name in ("ended", "repeated", "lost", "moved")] == [100.0, 0, 0, 0]


@pytest.mark.physics
@pytest.mark.deep
def test_a_bad_sensor_has_a_figure_of_what_it_costs(tmp_path: Path) -> None:
    options = ("--trials", "1", "--workers", "2", "--ecms", ECMS, "--out", str(tmp_path))
    assert main(["experiment", "14/latency/0", "14/latency/0.2", *options]) == Exit.SUCCESS
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    cells = [row["cells"] for row in one["rows"]]
    assert [cell["success"]["measured"] for cell in cells] == [100.0, 0.0]
    assert [cell["violation"]["hits"] for cell in cells] == [0, 0]
    assert "latency, s" in (tmp_path / "figures" / "experiment-14-latency.svg").read_text(encoding="utf-8")


@pytest.mark.physics
@pytest.mark.deep
def test_reaction_times_with_a_slow_planner_are_drawn_over_its_latency(tmp_path: Path) -> None:
    options = ("--trials", "1", "--workers", "1", "--ecms", ECMS, "--out", str(tmp_path))
    assert main(["experiment", "15/person/0", "15/person/1.5", *options]) == Exit.SUCCESS
    (one,) = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["experiments"]
    assert [row["cells"]["reaction"]["measured"] for row in one["rows"]] == [0.0, 0.0]
    drawn = (tmp_path / "figures" / "experiment-15-person.svg").read_text(encoding="utf-8")
    assert len(marks(drawn, "measured")) == 2 * 4
    assert "what each plan takes, s" in drawn


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["44"], "there is no experiment `44`"),
        (["4", "--architecture", "flatt"], "there is no architecture `flatt`"),
        (["4", "--executor", "ray://"], "expected `dask://HOST:PORT`"),
        (["4", "--executor", "dask://10.0.0.7:8786"], "would not be encrypted"),
        (["4", "--executor", "dask://10.0.0.7:8786", "--tls-ca", ECMS], "give all of them"),
        (["4", "--out", "/proc/nobody"], "cannot write to `/proc/nobody`"),
    ],
)
def test_unknown_names_are_refused(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ("--plant", "symbolic", "--trials", "4", "--ecms", ECMS, "--out", str(tmp_path))
    assert main(["experiment", *common, *arguments]) == Exit.USAGE
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("package", "message"),
    [
        ("jinja2", "(jinja2 is missing)"),
        ("markdown_it", "(markdown_it is missing)"),
        ("matplotlib", "(matplotlib is missing)"),
        ("scipy.stats", "experiments need `pip install"),
        ("py_trees.behaviour", "`behaviour_tree` needs `pip install"),
    ],
)
def test_a_missing_dependency_is_reported_before_any_trial(
    package: str,
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # The package is imported anew: without this it would stay an attribute of `aeros`.
    monkeypatch.setattr(aeros, "experiments", aeros.experiments)
    for name in [name for name in sys.modules if name.startswith("aeros.experiments")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    assert run(tmp_path, "4/behaviour_tree") == Exit.USAGE
    assert message in capsys.readouterr().err
    assert not (tmp_path / TRIALS_FILE).exists()


def test_to_resume_takes_a_folder(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["experiment", "1", "--resume"]) == Exit.USAGE
    assert "--out FOLDER" in capsys.readouterr().err
