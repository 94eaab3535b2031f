"""The policy section of a site: limits, access, overrides and quotas."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import policy as declared_policy
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import load_site
from aeros.spec.elaborate.policy import elaborate_isolation, elaborate_worker_limits
from aeros.spec.model.policy import Execute, McpPolicy
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.fields import TextField
from aeros.spec.text.nodes import ScalarNode
from tests.unit.spec.faults import messages_of_module, messages_of_site

SPAN = Source("site.yaml", "policy").span(0, 6)


def test_a_limit_beyond_every_double_is_refused(tmp_path: Path) -> None:
    (message,) = messages_of_site(tmp_path, ("skill_timeout: 60 s", "skill_timeout: 1e400 s"))
    assert message.startswith("error[AE207] malformed-quantity: `1e400 s` is beyond 1.8e+308")


@pytest.mark.parametrize("planning", ["0 s", "3601 s"])
def test_a_planner_has_some_time_and_no_more_than_an_hour(tmp_path: Path, planning: str) -> None:
    (message,) = messages_of_site(tmp_path, ("replans: 5}", f"replans: 5, planning: {planning}}}"))
    assert message.startswith(
        "error[AE129] beyond-limits: the time for a plan must be above 0 s and at most 1 h"
    )


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("actuators: [arm, turntable]", "actuators: [arm, crane]"), "`crane` is not an actuator of any"),
        (("sensors: [panel, scanner,", "sensors: [pannel, scanner,"), "`pannel` is not a sensor of any"),
        (("module: works_but_is_blocked, action: wipe", "action: whipe"), "`whipe` is not an action kind"),
        (("module: works_but_is_blocked, action: wipe", "skill: wipe"), "a blocked skill needs its `module`"),
        (("on: [wipe], at_most: 30", "on: [stop], at_most: 30"), "a quota must not count the"),
        (("within: 60 s", "within: 0 s"), "a quota's window must be above 0 s"),
    ],
)
def test_a_fault_of_the_policy_is_reported(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    found = messages_of_site(tmp_path, edit)
    assert any(message in line for line in found), found


@pytest.mark.parametrize(
    ("worker", "message"),
    [
        ("{memory: 257 MiB}", "this site allows the process of a skill at most 256 MiB"),
        ("{memory: 64 MB}", "`64 MB` is not an amount of memory"),
        ("{answer_within: 6 s}", "skill code has above 0 s and at most 5 s before each action"),
        ("{answer_within: 0 s}", "skill code has above 0 s and at most 5 s before each action"),
        ("{answer_within: 2 N}", "error[AE204]"),
        ("{processor: 101 %}", "a processor share is at least 1 % and at most 100 % here"),
        ("{processor: 0.5 %}", "a processor share is at least 1 % and at most 100 % here"),
        ("{processor: 1 s}", "error[AE204]"),
    ],
)
def test_a_module_asks_for_no_more_than_the_site_allows(tmp_path: Path, worker: str, message: str) -> None:
    (found,) = messages_of_module(tmp_path, ("permissions:\n", f"permissions:\n  worker: {worker}\n"))
    assert message in found


@pytest.mark.parametrize(
    "worker",
    [
        "{}",
        "{memory: 256 MiB}",
        "{memory: 64 MiB, answer_within: 500 ms}",
        "{processor: 1 %}",
        "{processor: 1}",
    ],
)
def test_a_module_may_ask_for_less(tmp_path: Path, worker: str) -> None:
    assert messages_of_module(tmp_path, ("permissions:\n", f"permissions:\n  worker: {worker}\n")) == []


@pytest.mark.parametrize(
    ("asked", "granted", "share"),
    [("50 %", "50 %", Fraction(1, 2)), ("0.25", "0.5", Fraction(1, 4)), (None, "50 %", Fraction(1, 2))],
)
def test_a_module_has_the_share_that_it_asks_for_within_that_of_the_site(
    tmp_path: Path, asked: str | None, granted: str, share: Fraction
) -> None:
    diagnostics = Diagnostics()
    isolation = elaborate_isolation(_isolation(granted), diagnostics)
    worker = elaborate_worker_limits(_worker(asked), isolation, diagnostics)
    assert worker is not None
    assert worker.processor == share
    assert len(diagnostics) == 0
    assert elaborate_worker_limits(_worker("51 %"), isolation, diagnostics) is not None
    (refused,) = diagnostics
    assert (refused.code, refused.headline) == (
        "AE129",
        "a processor share is at least 1 % and at most 50 % here",
    )


def _text(value: str | None) -> TextField | None:
    return None if value is None else TextField(value, SPAN, ScalarNode(value, SPAN))


def _isolation(processor: str) -> declared_policy.IsolationPolicy:
    return declared_policy.IsolationPolicy(SPAN, processor=_text(processor))


def _worker(processor: str | None) -> declared_ecm.WorkerLimits:
    return declared_ecm.WorkerLimits(SPAN, processor=_text(processor))


def test_a_computing_device_has_a_file_by_which_it_shows(tmp_path: Path) -> None:
    device = "\ncompute: {gpu: PATH}\n\nresources: {"
    granted = ("actuators: [arm, turntable]", "actuators: [arm, turntable]\n    compute: [gpu]")
    edit = "\nresources: {"
    assert messages_of_site(tmp_path, granted, (edit, device.replace("PATH", "/dev/nvidia0"))) == []
    (unknown,) = messages_of_site(tmp_path, granted)
    assert "`gpu` is not a device under `compute` of the site" in unknown
    for path in ("nvidia0", "/dev/../etc/passwd", "/usr/lib/gpu"):
        (found,) = messages_of_site(tmp_path, granted, (edit, device.replace("PATH", path)))
        assert "is not a device file" in found


def loaded(folder: Path, section: str) -> tuple[Site | None, list[str]]:
    text = reference_site_path().read_text().replace("policy:\n", f"policy:\n{section}", 1)
    (folder / "site.yaml").write_text(text)
    sink = Diagnostics()
    return load_site(folder / "site.yaml", sink), [one.headline for one in sink]


@pytest.mark.parametrize(
    ("section", "policy"),
    [
        ("", McpPolicy(Execute.APPROVAL, 20, None)),
        ("  mcp: {most_steps: 3}\n", McpPolicy(Execute.APPROVAL, 3, None)),
        ("  mcp: {execute: allowed, skills: [a.b]}\n", McpPolicy(Execute.ALLOWED, 20, frozenset(("a.b",)))),
        ("  mcp: {execute: elicitation}\n", McpPolicy(Execute.ELICITATION, 20, None)),
        ("  mcp: {execute: denied, skills: []}\n", McpPolicy(Execute.DENIED, 20, frozenset())),
    ],
)
def test_a_missing_mcp_setting_has_the_stricter_default(
    section: str, policy: McpPolicy, tmp_path: Path
) -> None:
    site, message = loaded(tmp_path, section)
    assert message == []
    assert site is not None
    assert site.mcp == policy


@pytest.mark.parametrize(
    "section", ["  mcp: {execute: maybe}\n", "  mcp: {most_steps: 0}\n", "  mcp: {approve: never}\n"]
)
def test_an_unknown_mcp_setting_is_refused(section: str, tmp_path: Path) -> None:
    site, message = loaded(tmp_path, section)
    assert site is None
    assert len(message) == 1
