"""Resources in the view of `aeros top`: use beside limits, whatever a file holds."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.top.resources import quota_text, resource_rows, tools_view
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from tests.unit.spec.difference.versions import BASE, change
from tests.unit.spec.difference.whole_files import add_every_section

MIB = 2**20


def code(used: int | None, started: int = 2, limit: int | None = 64 * MIB) -> dict[str, Any]:
    return {
        "memory": {"used": used, "at_most": limit},
        "answer": {"longest": 0.25, "at_most": 5.0 if limit else None},
        "processes": {"running": 1, "started": started},
    }


def lines(modules: Any, tools: Any = None) -> list[str]:
    return [" ".join(" ".join(row).split()) for row in resource_rows(modules, tools or {})]


def test_use_is_beside_its_limit() -> None:
    module = {
        "is_isolated": True,
        **code(3 * MIB),
        "devices": ["gpu"],
        "channels": ["radio"],
        "perceivers": {"watch": code(None)},
    }
    assert lines({"polish": module}) == [
        "polish memory 3 of 64 MiB longest answer 0.25 of 5 s processes 1 running, 2 started "
        "device gpu channel radio",
        "polish.watch memory ? of 64 MiB longest answer 0.25 of 5 s processes 1 running, 2 started",
    ]


def test_code_that_has_not_run_has_limits_alone() -> None:
    assert lines({"polish": code(None, started=0)}) == [
        "polish not started; at most 64 MiB, 5 s for an answer"
    ]
    assert lines({"polish": code(None, started=0, limit=None)}) == ["polish not started"]


def test_trusted_code_has_no_limits() -> None:
    assert lines({"polish": {"is_isolated": False, **code(None, limit=None)}}) == [
        "polish in the runtime's own process longest answer 0.25 s processes 1 running, 2 started"
    ]


@pytest.mark.parametrize(
    "odd", [None, 3, "text", [], {"polish": None}, {"polish": {"memory": 3, "answer": []}}]
)
def test_a_file_with_other_contents_does_not_stop_the_view(odd: Any) -> None:
    assert len(lines(odd)) == (len(odd) if type(odd) is dict else 0)


def test_tools_are_shown_with_their_calls_and_quotas(tmp_path: Path) -> None:
    add_every_section(copied := Path(shutil.copytree(BASE, tmp_path / "site")))
    change(copied / "site.yaml", "on: [grip], at_most", "on: [grip, ask], at_most")
    site = load_site(copied / "site.yaml", Diagnostics())
    assert site is not None
    view = tools_view(site, {"ask": (4, 1)}, {"grip-rate": {"used": 3, "at_most": 60}})
    assert lines({}, view) == [
        "tool ask 4 calls, 1 failed each at most 2 s quota grip-rate 3/60",
        *(f"tool {name} 0 calls, 0 failed each at most 2 s" for name in ("start", "look_up", "call")),
    ]


def test_without_the_site_the_calls_are_shown() -> None:
    assert lines({}, tools_view(None, {"ask": (1, 0)}, {})) == ["tool ask 1 calls, 0 failed"]


def test_a_quota_without_a_known_limit_shows_its_use() -> None:
    assert quota_text({"used": 3, "at_most": 60}) == "3/60"
    assert quota_text({"used": 3, "at_most": None}) == "3"
