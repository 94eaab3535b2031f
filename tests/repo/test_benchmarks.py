"""The benchmarks run, whatever they measure: no test here depends on time."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from tests.repo.tree import ROOT


def _run(name: str) -> Any:
    command = [sys.executable, "-m", f"benchmarks.{name}", "--quick", "--format", "json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_benchmark_of_verify_runs() -> None:
    found = _run("verify")
    assert set(found["reference"]) == {"python -c pass", "python -c 'import z3'", "cold", "warm"}
    assert [row["modules"] for row in found["synthetic"]] == [2, 4]


def test_the_benchmark_of_the_closed_loop_runs() -> None:
    assert [row["steps"] for row in _run("closed_loop")] == [5]


@pytest.mark.parametrize("name", ["verify", "closed_loop"])
def test_each_benchmark_is_published_with_how_to_rerun_it(name: str) -> None:
    assert f"python -m benchmarks.{name}" in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
