"""A module for a task of its own, with its predicate, detector, object and numbers, and a shipped module.

It is written as a new user would: nothing of `aeros` and no site is changed for it. It runs at three sites.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.text.discovery import reference_site_path
from tests.modules.other_sites import bindings, site_with_other_names, slower_site
from tests.repo.tree import ROOT

MODULE = Path(__file__).parents[1] / "data" / "lay_block"
SHIPPED = ROOT / "ecms" / "clean_table"


def aeros(*arguments: str, **paths: Path) -> int:
    options = [part for name, path in paths.items() for part in (f"--{name}", str(path))]
    return main([*arguments, *options])


def reference_site(folder: Path) -> Path:
    return Path(reference_site_path())


@pytest.mark.physics
@pytest.mark.parametrize(
    ("plant", "make_site", "binding", "shipped_settings"),
    [
        ("kinematic", reference_site, "area=table_area", ()),
        pytest.param("physics", reference_site, "area=table_area", (), marks=pytest.mark.deep),
        pytest.param(
            "physics",
            site_with_other_names,
            "area=counter_space",
            bindings("clean_table"),
            marks=pytest.mark.deep,
        ),
        pytest.param("physics", slower_site, "area=table_area", (), marks=pytest.mark.deep),
    ],
)
def test_it_is_configured_composed_and_true_in_the_simulator(
    plant: str,
    make_site: Callable[[Path], Path],
    binding: str,
    shipped_settings: Sequence[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    state = tmp_path / "robot"
    assert aeros("policy", str(make_site(tmp_path)), state=state) == Exit.SUCCESS
    assert aeros("install", str(MODULE), state=state) == Exit.REJECTED  # the other is not there yet
    for folder in (SHIPPED, MODULE):
        assert aeros("install", str(folder), state=state) == Exit.SUCCESS
    shipped = [word.removeprefix("clean_table.") for word in shipped_settings]
    assert aeros("configure", "clean_table", *shipped, state=state) == Exit.SUCCESS
    assert aeros("configure", "lay_block", "--bind", binding, state=state) == Exit.SUCCESS
    for name in ("clean_table", "lay_block"):
        assert aeros("activate", name, state=state) == Exit.SUCCESS
    run = ("run", "lay the purple block on its spot", "--plant", plant, "--seed", "4")
    assert aeros(*run, state=state, out=tmp_path / "run") == Exit.SUCCESS
    assert "goal reached: believed true, true in the simulator" in capsys.readouterr().out
    records = [json.loads(line) for line in (tmp_path / "run" / "audit.jsonl").read_text().splitlines()]
    ran = [one["details"] for one in records if one["event"] == "step-ended"]
    assert {one["module"] for one in ran} == {"clean_table", "lay_block"}


def test_a_picture_that_no_camera_offers_is_refused_before_it_runs(tmp_path: Path) -> None:
    folder = tmp_path / "lay_block"
    folder.mkdir()
    for path in MODULE.iterdir():
        if path.is_file():
            text = path.read_text().replace("width: 320, height: 240", "width: 640, height: 480")
            (folder / path.name).write_text(text)
    bound = ("--bind", "lay_block.area=table_area", "--no-lock")
    assert main(["verify", str(folder), *bound]) == Exit.REJECTED
