"""The policy section of a site file: its form alone."""

from __future__ import annotations

import pytest

from aeros.spec.declared.decode import decode
from aeros.spec.declared.policy import Policy
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.yaml_reader import read_yaml

_LEAST = """\
risk_ceiling: medium
access: {actuators: [arm]}
limits: {skill_timeout: 60 s, retries: 2, replans: 5}
"""


def policy(text: str) -> tuple[Policy | None, list[str]]:
    sink = Diagnostics()
    node = read_yaml(Source("site.yaml", text), sink)
    assert node is not None
    return decode(node, Policy, sink), [one.code for one in sink]


def test_optional_parts_of_a_policy_are_empty_or_absent() -> None:
    found, message = policy(_LEAST)
    assert message == []
    assert found is not None
    assert len(found.grants) == len(found.blocks) == len(found.quotas) == 0
    assert (found.audit, found.isolation, found.mcp, found.undeclared_outcome) == (None,) * 4


@pytest.mark.parametrize(
    "text",
    [
        _LEAST.replace("medium", "extreme"),
        _LEAST.replace("retries: 2", "retries: 101"),
        _LEAST.replace("actuators: [arm]", "motors: [arm]"),
        _LEAST + "audit: {durability: never}\n",
        _LEAST + "mcp: {most_steps: 0}\n",
    ],
)
def test_a_policy_of_another_form_is_refused(text: str) -> None:
    found, message = policy(text)
    assert found is None
    assert len(message) == 1
