"""A site's rules for clients of `aeros mcp`; without any, the operator approves."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.policy import Execute, McpPolicy
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


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
