"""A change of a tool is found: another service is newly allowed, and the earlier one newly denied."""

# ruff: noqa: E501  a change stands in one line with what it leads to

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.difference.versions import change, changed, named, sites

OTHER = "changed"


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("127.0.0.1:8080/ask", "127.0.0.1:9999/ask", {"actions/ask/tool/service": "incomparable"}),
        ("token: TOKEN", "token: OTHER", {"actions/ask/tool/token": OTHER}),
        ('{http: "http://127.0.0.1:8080/ask"', "{program: [/usr/bin/ask]", {"actions/ask/tool/service": "incomparable", "actions/ask/tool/token": OTHER}),
        ("{tool: times, url: \"http://127.0.0.1:8081/mcp\"}", "{tool: times, command: [/usr/bin/server]}", {"actions/look_up/tool/service": "incomparable"}),
        ("answers: []}\n  call", "answers: [], token: TOKEN}\n  call", {"actions/look_up/tool/token": OTHER}),
    ],
)  # fmt: skip
def test_another_service_of_a_tool_is_newly_allowed(
    before: str, after: str, expected: dict[str, str], rich: tuple[Path, Path]
) -> None:
    old, new = rich
    if "program" in after:
        after, before = (
            after + ", timeout: 2 s, answers: [answered, answered_too]",
            before + ", timeout: 2 s, answers: [answered, answered_too], token: TOKEN",
        )
    change(new / "site.yaml", before, after)
    assert changed(sites(old, new)) == expected


def test_the_addresses_before_and_now_are_shown(rich: tuple[Path, Path]) -> None:
    old, new = rich
    change(new / "site.yaml", "127.0.0.1:8080/ask", "127.0.0.1:9999/ask")
    more, less = named(sites(old, new), "actions/ask/tool/service").diagnostics
    assert more.headline == "`ask` calls `http://127.0.0.1:9999/ask`, before `http://127.0.0.1:8080/ask`"
    assert (more.code, less.code) == ("AE951", "AE952")


def test_an_action_that_a_service_carries_out_in_place_of_the_robot_is_newly_allowed(
    rich: tuple[Path, Path],
) -> None:
    old, new = rich
    change(new / "site.yaml", "    tool: {program: [/usr/bin/true, now], timeout: 2 s, answers: []}\n", "")
    assert changed(sites(old, new)) == {"actions/start/tool": "incomparable"}
    assert changed(sites(new, old)) == {"actions/start/tool": "incomparable"}
    (more, _) = named(sites(old, new), "actions/start/tool").diagnostics
    assert more.headline == "`start` is carried out by the robot, before by the program `/usr/bin/true now`"


def test_a_longer_time_limit_and_a_further_answer_are_newly_allowed(rich: tuple[Path, Path]) -> None:
    old, new = rich
    change(new / "site.yaml", '8080/ask", timeout: 2 s', '8080/ask", timeout: 3 s')
    assert changed(sites(old, new)) == {"actions/ask/tool/timeout": "newly allowed"}
    assert changed(sites(new, old)) == {"actions/ask/tool/timeout": "newly denied"}
