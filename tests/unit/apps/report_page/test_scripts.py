"""The page's script sets the film to a time of the run, and its cursor follows the film."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.report_page.scripts import FILM, FILTER

BROWSER = Path(__file__).with_name("data") / "film_page.js"

needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")


def used(items: list[str | None], steps: list[list[Any]], **film: str) -> dict[str, Any]:
    """Use a page whose film shows a run from 2 to 14 s at four times its speed, on an axis of 20 s."""
    page = {
        "script": FILTER + FILM,
        "film": {"start": "2.0", "end": "14.0", "speed": "4.0"} | film,
        "cursor": {"left": "190", "width": "900", "end": "20.0"},
        "items": items,
        "steps": steps,
    }
    run = subprocess.run(
        [shutil.which("node") or "node", str(BROWSER), json.dumps(page)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert run.returncode == 0, run.stderr
    result: dict[str, Any] = json.loads(run.stdout)
    return result


@needs_node
def test_an_item_sets_the_film_to_its_time_of_the_run() -> None:
    items = ["10.000", "2.000", "14.000", None]
    steps = [
        ["click", 0],
        ["keydown", 1, "Enter"],
        ["keydown", 2, "Enter"],
        ["keydown", 0, "x"],
        ["click", 3],
    ]
    page = used(items, [*steps, ["keydown", 0, " "]])
    # 8 s of the run are 2 s of the film; the film ends after 3 s.
    assert [one["time"] for one in page["seen"]] == pytest.approx([2.005, 0.005, 2.98, 2.98, 2.98, 2.005])
    assert [one["prevented"] for one in page["seen"]] == [True, True, True, False, False, True]
    # 45 px a second of the run.
    assert page["seen"][0]["cursor"] == "translate(640.9)"
    button = {"tabindex": "0", "role": "button"}
    assert page["items"] == [button, button, button, {}]
    # A mark keeps its own title and is not inside a picture any more, for those who cannot see.
    assert page["titles"] == ["show this in the film", None, "show this in the film", None]
    assert page["svg"] == {"role": "group"}


@needs_node
def test_the_cursor_follows_the_film_while_it_plays() -> None:
    page = used(["10.000"], [["play"], ["frame", 1.0], ["frame", 99.0], ["pause"]])
    assert [one["cursor"] for one in page["seen"]] == [
        "translate(280.0)", "translate(460.0)", "translate(820.0)", "translate(820.0)"
    ]  # fmt: skip
    assert [one["waiting"] for one in page["seen"]] == [1, 1, 1, 0]
    assert page["display"] is None


@needs_node
def test_the_cursor_is_hidden_before_the_film_is_used() -> None:
    assert used(["10.000"], [])["display"] == "none"
