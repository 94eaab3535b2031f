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
    tool = '    tool: {mcp: {tool: times, url: "http://127.0.0.1:8081/mcp"}, timeout: 2 s, answers: []}\n'
    change(new / "site.yaml", tool, "")
    assert changed(sites(old, new)) == {"actions/look_up/tool": "incomparable"}
    assert changed(sites(new, old)) == {"actions/look_up/tool": "incomparable"}
    (more, _) = named(sites(old, new), "actions/look_up/tool").diagnostics
    server = "the tool `times` of the MCP server `http://127.0.0.1:8081/mcp`"
    assert more.headline == f"`look_up` is carried out by the robot, before by {server}"


def test_a_longer_time_limit_and_a_further_answer_are_newly_allowed(rich: tuple[Path, Path]) -> None:
    old, new = rich
    change(new / "site.yaml", '8080/ask", timeout: 2 s', '8080/ask", timeout: 3 s')
    assert changed(sites(old, new)) == {"actions/ask/tool/timeout": "newly allowed"}
    assert changed(sites(new, old)) == {"actions/ask/tool/timeout": "newly denied"}


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("reads: [/opt/a]", "reads: [/opt/a, /opt/b]", {"confinement/reads": "newly allowed"}),
        ("reads: [/opt/a]", "reads: []", {"confinement/reads": "newly denied"}),
        ("reads: [/opt/a]", "reads: [/opt/a], writes: [/opt]", {"confinement/writes": "newly allowed"}),
        ("network: false", "network: true", {"confinement/network": "newly allowed"}),
        ("memory: 256 MiB", "memory: 1 GiB", {"confinement/memory": "newly allowed"}),
        ("processor: 50 %", "processor: 20 %", {"confinement/processor": "newly denied"}),
        ("processes: 4", "processes: 5", {"confinement/processes": "newly allowed"}),
        ("channel: office", "channel: internet", {"channel": "incomparable"}),
        (", channel: office", "", {"channel": "newly allowed"}),
    ],
)
def test_a_wider_confinement_is_newly_allowed(
    old: Path, new: Path, before: str, after: str, expected: dict[str, str]
) -> None:
    confinement = "{reads: [/opt/a], network: false, memory: 256 MiB, processor: 50 %, processes: 4}"
    tool = f"{{program: [/bin/ask], timeout: 2 s, answers: [], confinement: {confinement}, channel: office}}"
    kind = f"  ask: {{description: ask, risk: low, tool: {tool}}}\n"
    for folder in (old, new):
        change(folder / "site.yaml", "actions:\n", f"actions:\n{kind}")
    change(new / "site.yaml", before, after)
    found = {f"actions/ask/tool/{place}": words for place, words in expected.items()}
    assert changed(sites(old, new)) == found
