"""`aeros check-plant` says of each promise if the plant keeps it, and what it found; scenes are of `ecms`."""

from __future__ import annotations

import json
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.sim.conformance.suite import CHECKS
from tests.unit.cli.robot import checked_plants

PLANTS = checked_plants.__name__


def checked(capsys: pytest.CaptureFixture[str], name: str, *options: str) -> tuple[int, str]:
    code = main(["check-plant", f"{PLANTS}:{name}", *options])
    shown = capsys.readouterr()
    return code, shown.out + shown.err


@pytest.mark.parametrize("name", ["GOOD", "good"])
def test_a_plant_that_keeps_its_promises_passes(capsys: pytest.CaptureFixture[str], name: str) -> None:
    code, shown = checked(capsys, name)
    assert code == 0
    assert f"{len(CHECKS)} of {len(CHECKS)} promises kept" in shown
    assert shown.count("kept    ") == len(CHECKS)


def test_a_broken_promise_is_named_with_what_was_found(capsys: pytest.CaptureFixture[str]) -> None:
    chosen = ("--check", "the_executed_motion_is_the_decided_one", "--check", "the_clock_never_goes_back")
    code, shown = checked(capsys, "STANDING", *chosen)
    assert code == 1
    assert "kept    the clock never goes back" in shown
    assert "BROKEN  the executed motion is the decided one\n        promise  Joints and base are" in shown
    assert "\n        found    " in shown
    code, shown = checked(capsys, "STANDING", *chosen, "--format", "json")
    report: dict[str, Any] = json.loads(shown)
    assert (code, report["schema"]) == (1, "aeros/plant-check/1")
    assert [one["failure"] is None for one in report["checks"]] == [True, False]
    assert report["not_tried"] == ["moves in contact", "motions of arm and base at once", "pictures"]


def test_code_that_raises_breaks_the_promise(capsys: pytest.CaptureFixture[str]) -> None:
    code, shown = checked(capsys, "without_robot", "--check", "close_is_idempotent")
    assert code == 1
    assert "found    the plant raised ConnectionRefusedError: no robot" in shown


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        (f"{PLANTS}:ABSENT", "cannot be imported: AttributeError"),
        ("no.such.module:X", "cannot be imported: ModuleNotFoundError"),
        (f"{PLANTS}:fails", "makes no `PlantUnderTest`: OSError: no drive"),
        (f"{PLANTS}:other", "makes an object of type int"),
        ("symbolic", "has no robot"),
        ("turntabel", "no plant is called `turntabel`"),
        ("kinematik", "did you mean `kinematic`?"),
    ],
)
def test_a_plant_that_is_not_there_is_a_usage_error(
    capsys: pytest.CaptureFixture[str], name: str, reason: str
) -> None:
    assert main(["check-plant", name]) == 2
    assert reason in capsys.readouterr().err


def test_a_plant_of_others_brings_its_own_robot(capsys: pytest.CaptureFixture[str]) -> None:
    assert checked(capsys, "GOOD", "--site", __file__)[0] == 2
