"""A change of a tool is found in its direction: a program that may use more is newly allowed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.difference.versions import change, changed, sites

BEFORE = """actions:
  ask:
    description: ask
    risk: low
    tool:
      program: [/bin/ask, now]
      confinement: {reads: [/opt/a], network: false, memory: 256 MiB, processor: 50 %, processes: 4}
      timeout: 2 s
      answers: [dirt]
"""
STATE = "state:\n  dirt: {type: real, unit: kg, range: [0, 1], sensor: ask, max_age: 9 s}\n"
MORE, LESS = "newly allowed", "newly denied"


@pytest.fixture
def both(old: Path, new: Path) -> tuple[Path, Path]:
    """Two versions of a site with a tool."""
    for folder in (old, new):
        change(folder / "site.yaml", "actions:\n", BEFORE)
        change(folder / "site.yaml", "state:\n", STATE)
    return old, new


def differences(both: tuple[Path, Path], before: str, after: str) -> dict[str, str]:
    old, new = both
    change(new / "site.yaml", before, after)
    return changed(sites(old, new))


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("reads: [/opt/a]", "reads: [/opt/a, /opt/b]", {"confinement/reads": MORE}),
        ("reads: [/opt/a]", "reads: []", {"confinement/reads": LESS}),
        ("reads: [/opt/a]", "reads: [/opt/a], writes: [/opt]", {"confinement/writes": MORE}),
        ("network: false", "network: true", {"confinement/network": MORE}),
        ("memory: 256 MiB", "memory: 1 GiB", {"confinement/memory": MORE}),
        ("processor: 50 %", "processor: 20 %", {"confinement/processor": LESS}),
        ("processes: 4", "processes: 5", {"confinement/processes": MORE}),
        ("timeout: 2 s", "timeout: 1 s", {"timeout": LESS}),
    ],
)
def test_a_wider_confinement_is_newly_allowed(
    both: tuple[Path, Path], before: str, after: str, expected: dict[str, str]
) -> None:
    found = differences(both, before, after)
    assert found == {f"actions/ask/{place}": words for place, words in expected.items()}


@pytest.mark.parametrize(
    "after",
    [
        "program: [/bin/ask, later]",
        "mcp: {tool: ask, command: [/bin/ask, now]}",
    ],
)
def test_another_service_is_a_change(both: tuple[Path, Path], after: str) -> None:
    (found,) = differences(both, "program: [/bin/ask, now]", after)
    assert found == "actions/ask/tool"


def test_an_equal_tool_is_no_change(both: tuple[Path, Path]) -> None:
    assert changed(sites(*both)) == {}


def test_a_tool_in_place_of_a_motion_is_a_change(old: Path, new: Path) -> None:
    change(new / "site.yaml", "  wait:\n", "  wait:\n    tool: {program: [a], timeout: 1 s, answers: []}\n")
    assert list(changed(sites(old, new))) == ["actions/wait/tool"]
