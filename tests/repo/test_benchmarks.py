"""The benchmarks run, whatever they measure: no test here depends on time."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from typing import Any

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT


def _run(name: str, *more: str) -> Any:
    command = [sys.executable, "-m", f"benchmarks.{name}", "--quick", "--format", "json", *more]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.deep
def test_the_benchmark_of_verify_runs() -> None:
    found = _run("verify")
    assert set(found["reference"]) == {"python -c pass", "python -c 'import z3'", "cold", "warm"}
    assert [row["modules"] for row in found["synthetic"]] == [2]


@pytest.mark.deep
def test_the_benchmark_of_swaps_runs() -> None:
    found = _run("registry.swap")
    rows = [found["shipped"], found["synthetic"]["2"]]
    assert [set(row) for row in rows] == [{"install", "configure", "activate", "gate", "swap"}] * 2


@pytest.mark.deep
def test_the_benchmark_of_random_starts_counts_what_runs_record() -> None:
    found = _run("starts", "wipe the left half of the table", "--plant", "kinematic")
    assert (found["runs"], len(found["each"])) == (1, 1)
    assert found["steps"] == len(found["each"][0]["way"])
    counts = [found[name] for name in ("reached", "believed", "false_claims", "not_refereed")]
    assert counts == [1, 1, 0, 0]


def test_a_run_on_a_plant_without_truth_is_no_success() -> None:
    found = _run("starts", "--plant", "symbolic")
    counts = [found[name] for name in ("reached", "believed", "false_claims", "not_refereed")]
    assert counts == [0, 1, 0, 1]


def test_the_benchmark_of_the_closed_loop_runs() -> None:
    assert [row["steps"] for row in _run("closed_loop")] == [5]


def test_the_benchmark_of_the_gate_runs_and_aeros_allows_nothing_corrupted() -> None:
    found = _run("gate")
    rows = {row["engine"]: row for row in found["engines"]}
    assert 0 < found["allowed"] < found["requests"]
    assert {"by hand, naive", "by hand, checked", "AEROS compiled", "AEROS z3"} <= rows.keys()
    for name in ("by hand, checked", "AEROS compiled", "AEROS z3"):
        assert rows[name]["fail_opens"] == []
    assert rows["by hand, naive"]["fail_opens"]


def test_the_benchmark_of_the_monitors_runs_and_aeros_knows_nothing_of_what_is_missing() -> None:
    found = _run("monitors")
    assert {row["window"] for row in found["windows"]} == {10}
    assert found["after_corruption"]["AEROS"] == {"nan": "unknown", "missing": "unknown"}


@pytest.mark.parametrize(
    ("name", "page"),
    [
        ("verify", "benchmarks.md"),
        ("closed_loop", "benchmarks.md"),
        ("starts", "starts.md"),
        ("gate", "benchmarks-gate.md"),
        ("monitors", "benchmarks-gate.md"),
        ("symbolic", "benchmarks.md"),
        ("plant", "benchmarks.md"),
        ("registry.swap", "benchmarks.md"),
        ("engines.sim_to_sim", "plants.md"),
        ("external.is_bench", "benchmarks-external.md"),
        ("external.armguard", "benchmarks-external.md"),
    ],
)
def test_each_benchmark_is_published_with_how_to_rerun_it(name: str, page: str) -> None:
    assert f"python -m benchmarks.{name}" in (ROOT / "docs" / page).read_text(encoding="utf-8")


def test_the_benchmark_of_the_symbolic_plant_runs() -> None:
    command = [sys.executable, "-m", "benchmarks.symbolic", "--runs", "1"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("1 runs, 1 to their goal;")
    assert "audit record" in done.stdout


def test_the_benchmark_of_isolation_runs() -> None:
    command = [sys.executable, "-m", "benchmarks.isolation", "--invocations", "1"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line.partition(":")[0].partition(",")[0] for line in done.stdout.splitlines()[1:]] == [
        "first zygote",
        "an invocation",
        "an action",
    ]


@pytest.mark.physics
@pytest.mark.deep
def test_the_benchmark_of_both_engines_runs_each_case_on_each() -> None:
    found = _run("engines.sim_to_sim")
    assert [row["plant"] for row in found] == ["physics", "mujoco"]
    assert [(row["runs"], row["reached"], row["false_claims"]) for row in found] == [(1, 1, 0)] * 2
    assert all(row["force_max"] < 65.0 and row["distance_min"] == 20.0 for row in found)


@pytest.mark.physics
@pytest.mark.deep
@pytest.mark.parametrize("trials", [0, 1])
def test_the_benchmark_of_the_physics_plant_runs_and_the_motions_are_the_same_each_time(trials: int) -> None:
    found = _run("plant", "--trials", str(trials))
    (row,) = found["tasks"]
    assert row["reached"]
    assert row["is_reproduced"]
    assert set(found["parallel"]) == ({"PyBullet alone"} if trials else set())
    assert all(one["efficiency"] > 0.0 for one in found["parallel"].values())


@pytest.mark.physics
@pytest.mark.parametrize("is_whole", [False, pytest.param(True, marks=pytest.mark.deep)])
def test_the_benchmark_of_contact_finds_forces_inside_the_limits_of_the_site(is_whole: bool) -> None:
    found = _run("contact")
    assert len(found) == 3
    if is_whole:
        from benchmarks import contact

        site = load_site(reference_site_path(), Diagnostics())
        assert site is not None
        found = [asdict(one) for one in contact.measure(site, [0.1])]
        assert len(found) == 9
    assert all(one["speed"] == 0.1 for one in found)
    # ISO/TS 15066, table A.2, the least of all regions that the site names, quasi-static and transient.
    assert max(one["held"] for one in found) < 130.0
    assert max(one["peak"] for one in found) < 260.0
