"""Policy of a site: access that is merged, and overrides that match."""

from __future__ import annotations

import pytest

from aeros.spec.model.policy import Access, OperatorOverride


def test_merged_access_allows_what_either_allows() -> None:
    arm = Access(actuators=frozenset(("arm",)), sensors=frozenset(("camera",)))
    wheels = Access(actuators=frozenset(("wheels",)), compute=frozenset(("gpu",)))
    assert arm.merge(wheels) == Access(
        frozenset(("arm", "wheels")), frozenset(("camera",)), frozenset(), frozenset(("gpu",))
    )


@pytest.mark.parametrize(
    ("module", "skill", "action", "matches"),
    [
        (None, None, None, True),
        ("kitchen", None, None, True),
        ("kitchen", "boil", "heat", True),
        (None, None, "stir", False),
        ("kitchen", "wrap", "heat", False),
        ("laundry", None, "heat", False),
    ],
)
def test_an_override_matches_where_every_field_does(
    module: str | None, skill: str | None, action: str | None, matches: bool
) -> None:
    override = OperatorOverride("id", "reason", module, skill, action)
    assert override.matches("kitchen", "boil", "heat") is matches
    assert override.identity == ("id", "reason", module, skill, action)
