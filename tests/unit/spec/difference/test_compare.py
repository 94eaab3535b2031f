"""Two paths are compared, and nothing is where one of them cannot be read."""

from __future__ import annotations

import shutil
from pathlib import Path

from aeros.spec.difference.compare import PolicyDifference, compare, is_site
from aeros.spec.difference.policy_change import PolicyChange, Relation
from aeros.spec.verification.witness import Witness
from tests.unit.spec.difference.versions import BASE, change, changed, modules, sites


def test_a_rewriting_is_equal(old: Path, new: Path) -> None:
    change(new / "site.yaml", "abs(angle) <= 90 deg", "-90 deg <= angle and not angle > 90 deg")
    change(new / "tidy" / "ecm.yaml", "duration <= inputs.pause", "not duration > inputs.pause")
    assert changed(sites(old, new)) == changed(modules(old, new)) == {}


def test_any_file_but_a_manifest_is_a_site(old: Path) -> None:
    assert is_site(old / "site.yaml")
    assert not is_site(old / "tidy" / "ecm.yaml")
    assert not is_site(old / "tidy")
    assert not is_site(old / "nothing.yaml")


def _difference(*relations: Relation, witness: str | None = None) -> PolicyDifference:
    held = {} if witness is None else {witness: Witness((), {})}
    return PolicyDifference(tuple(PolicyChange("x", one, (), held) for one in relations))


def test_a_difference_allows_more_if_any_change_does_or_a_witness_shows_it() -> None:
    assert not _difference().allows_more
    assert not _difference(Relation.NEWLY_DENIED, Relation.UNDECIDED).allows_more
    assert _difference(Relation.EQUAL, Relation.INCOMPARABLE).allows_more
    assert _difference(Relation.UNDECIDED, witness="newly allowed").allows_more
    assert not _difference(Relation.UNDECIDED, witness="newly denied").allows_more


def test_a_difference_is_undecided_if_any_change_is() -> None:
    assert not _difference(Relation.INCOMPARABLE, Relation.CHANGED_OTHERWISE).undecided
    assert _difference(Relation.EQUAL, Relation.UNDECIDED).undecided
    assert _difference(Relation.NOT_COMPARABLE).undecided


def test_nothing_is_compared_where_a_side_cannot_be_read(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "risk: low", "risk: none")
    change(new / "site.yaml", "risk_ceiling: medium", "risk_ceiling: none")
    for found in (modules(old, new), modules(new, old), sites(old, new), sites(new, old)):
        assert found.changes == ()
        assert any(one.primary and "none" in one.primary.span.text for one in found.problems)
    found = compare(old / "tidy", old / "tidy", new / "site.yaml")
    assert (found.changes, [one.code for one in found.problems]) == ((), [found.problems[0].code])


def test_a_warning_does_not_stop_the_comparison(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "timeout: 20 s", "timeout: 21 s")
    found = compare(old, new, BASE / "site.yaml")
    assert [one.subject for one in found.changes if one.relation is not Relation.EQUAL] == [
        "tidy/pick_cloth/timeout"
    ]


def test_two_single_modules_are_compared_under_any_names(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "id: tidy", "id: neat")
    change(new / "tidy" / "ecm.yaml", "force <= 10 N", "force <= 11 N")
    assert changed(modules(old, new)) == {"neat/pick_cloth/grip": "newly allowed", "neat/id": "changed"}


def test_of_several_modules_those_of_one_name_are_compared(old: Path, new: Path) -> None:
    for side in (old, new):
        shutil.copytree(side / "tidy", side / "other")
        change(side / "other" / "ecm.yaml", "id: tidy", "id: other")
    change(new / "other" / "ecm.yaml", "force <= 10 N", "force <= 11 N")
    assert changed(compare(old, new, BASE / "site.yaml")) == {"other/pick_cloth/grip": "newly allowed"}
    shutil.rmtree(new / "tidy")
    gone = changed(compare(old, new, BASE / "site.yaml"))
    assert {name: word for name, word in gone.items() if name.startswith("tidy/")} == {
        f"tidy/{one}": "newly denied" for one in ("pick_cloth/grip", "wipe/move", "wipe/wait", "rest/wait")
    }
    assert gone["tidy"] == "changed"


def test_two_modules_of_one_name_on_one_side_are_refused(old: Path, new: Path) -> None:
    shutil.copytree(new / "tidy", new / "zz")
    found = compare(old, new, BASE / "site.yaml")
    assert found.changes == ()
    (problem,) = found.problems
    assert (problem.code, problem.headline) == ("AE120", "two modules are called `tidy`")
    assert [one.text for one in problem.secondary] == ["first here"]
