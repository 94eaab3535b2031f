"""Proofs about paths of tasks and compositions that run a skill rest on its declared outcomes."""

from __future__ import annotations

import pytest

from aeros.runtime.proving import prove_configuration
from aeros.spec.verification.outcome_dependencies import obligations_assuming_outcomes
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"
LOOP = ["closed-loop/clean_up/dispatch", "closed-loop/clean_up/effective", "closed-loop/clean_up/progress"]


@pytest.mark.parametrize(
    ("skill", "expected"),
    [("wipe", LOOP), ("pick_cloth", LOOP), ("rest", [])],
)  # fmt: skip
def test_claims_about_paths_rest_on_outcomes_and_no_others(skill: str, expected: list[str]) -> None:
    configuration, _ = prove_configuration([BASE / "tidy"], BASE / "site.yaml", certified=False)
    resting = obligations_assuming_outcomes(
        configuration.modules["tidy"], skill, configuration.certificates["tidy"]
    )
    found = list(map(str, resting))
    assert [one for one in found if one.startswith("closed-loop/")] == expected
    others = [one for one in found if not one.startswith("closed-loop/")]
    assert "composition/clean_once/wipe/ready" in others
    assert all(one.startswith("composition/clean_once/") for one in others)
    assert not [one for one in others if one.endswith(("handled", "handlers"))]
