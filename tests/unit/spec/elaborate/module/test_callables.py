"""Names by which the steps of a module call what other modules have."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.elaborate.module.callables import alternatives_of
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.step_graph import steps_of
from aeros.spec.text.discovery import NEIGHBOURS, Surroundings

ACCEPTED = Path(__file__).parents[4] / "corpus" / "accepted"
TWO = ACCEPTED / "capability_that_two_modules_provide"


def loaded(folder: Path, surroundings: Surroundings = NEIGHBOURS) -> tuple[Ecm | None, list[str]]:
    sink = Diagnostics()
    site = load_site(ACCEPTED.parent / "site" / "table.yaml", sink)
    assert site is not None
    found = load_ecm(folder, site, sink, surroundings)
    return None if found is None else found.ecm, [one.code for one in sink]


def names(ecm: Ecm | None, capability: str) -> list[str]:
    assert ecm is not None
    return [one.name for one in ecm.alternatives(capability)]


def test_a_required_capability_has_the_alternatives_of_all_modules_in_the_range() -> None:
    ecm, problems = loaded(TWO / "asker")
    assert problems == []
    assert names(ecm, "fetching") == ["one.fetch", "two.pick", "two.drop+pick"]
    assert ecm is not None
    assert {"one.fetch", "two.pick", "two.drop"} <= ecm.callable_skills.keys()
    assert "one.fetching" not in ecm.foreign.capabilities  # no dependency declares the module itself


@pytest.mark.parametrize(
    ("active", "found"),
    [((), ["one.fetch", "two.pick", "two.drop+pick"]), (("one",), ["one.fetch"]), (("old",), None)],
)
def test_active_modules_are_preferred_among_those_given(
    active: tuple[str, ...], found: list[str] | None
) -> None:
    folders = tuple(TWO / name for name in ("asker", "one", "two", "old"))
    ecm, problems = loaded(TWO / "asker", Surroundings(folders, frozenset(TWO / name for name in active)))
    assert problems == []
    assert names(ecm, "fetching") == (found or ["one.fetch", "two.pick", "two.drop+pick"])


def test_without_the_modules_that_it_calls_a_module_is_refused() -> None:
    alone = Surroundings((TWO / "asker",))
    assert loaded(TWO / "asker", alone) == (None, ["AE305"])
    asker = ACCEPTED / "steps_of_a_required_module" / "asker"
    ecm, problems = loaded(asker, Surroundings((asker,)))
    assert ecm is None
    assert set(problems) == {"AE301"}


def test_the_steps_of_a_sequence_are_named_as_others_name_them() -> None:
    two, _ = loaded(TWO / "two")
    assert two is not None
    first, second = alternatives_of(two, "fetching")
    assert (first.name, first.composition) == ("two.pick", None)
    assert second.composition is not None
    assert [one.runs for one in steps_of(second.composition.body)] == [("two.drop",), ("two.pick",)]


def test_a_capability_that_a_module_provides_and_requires_has_its_own_alternatives_first() -> None:
    ecm, problems = loaded(ACCEPTED / "capability_of_its_own_and_of_others" / "asker")
    assert problems == []
    assert names(ecm, "fetching") == ["seek", "one.fetch"]
