"""A module that names nothing of its site, under two sites: proved as bound, and run on physics."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.text.discovery import reference_site_path

MODULE = Path(__file__).parents[1] / "data" / "hover_high"

RENAMED = {
    "bench_area": "counter",
    "tool_position": "fingertips",
    "reduced-speed-near-person": "slow-beside-people",
    "own_base": "pillar",
}
"""Names of the reference site, and those of the other site."""


def other_site(folder: Path, **renamed: str) -> Path:
    text = reference_site_path().read_text()
    for old, new in renamed.items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "other.yaml"
    path.write_text(text.replace("id: panda_cell", "id: other_cell", 1))
    return path


def aeros(*arguments: str, **paths: Path) -> None:
    options = [part for name, path in paths.items() for part in (f"--{name}", str(path))]
    assert main([*arguments, *options]) == Exit.SUCCESS


@pytest.mark.physics
@pytest.mark.parametrize("is_other_site", [False, True])
def test_one_module_is_configured_and_runs_under_two_sites(*, is_other_site: bool, tmp_path: Path) -> None:
    state, area = tmp_path / "robot", "bench_area"
    if is_other_site:
        # The simulator measures the tool point under this name.
        names = {old: new for old, new in RENAMED.items() if old != "tool_position"}
        aeros("policy", str(other_site(tmp_path, **names)), state=state)
        area = "counter"
    aeros("install", str(MODULE), state=state)
    height = 0.25 if is_other_site else 0.4
    aeros(*("configure", "hover_high", "--bind", f"area={area}", "--set", f"height={height} m"), state=state)
    aeros("activate", "hover_high", state=state)
    aeros("run", "hover", "--seed", "3", state=state, out=tmp_path / "run")
    assert abs(tool_height(tmp_path / "run" / "measured.jsonl") - height) < 0.006


def tool_height(measured: Path) -> float:
    """The last measured height of the tool point, m."""
    states = [json.loads(line)["state"] for line in measured.read_text().splitlines()]
    return float(next(one["tool_position"][0][2] for one in reversed(states) if "tool_position" in one))


def test_the_same_files_are_proved_under_a_site_with_other_words(tmp_path: Path) -> None:
    site = other_site(tmp_path, **RENAMED)
    aeros("verify", str(MODULE), "--bind", "hover_high.area=counter", "--no-lock", site=site)
    aeros("verify", str(MODULE), "--bind", "hover_high.area=bench_area", "--no-lock")
