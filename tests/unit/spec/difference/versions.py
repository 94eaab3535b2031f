"""Two versions of the modules and the site of the examples in docs/codes, and their comparison."""

from __future__ import annotations

from pathlib import Path

from aeros.spec.difference.compare import PolicyDifference, compare
from aeros.spec.difference.policy_change import PolicyChange, Relation

BASE = Path(__file__).parents[4] / "docs" / "codes" / "base"


def change(path: Path, before: str, after: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(before) == 1, before
    path.write_text(text.replace(before, after), encoding="utf-8")


def modules(old: Path, new: Path) -> PolicyDifference:
    return compare(old / "tidy", new / "tidy", BASE / "site.yaml")


def sites(old: Path, new: Path) -> PolicyDifference:
    return compare(old / "site.yaml", new / "site.yaml", BASE / "site.yaml")


def changed(difference: PolicyDifference) -> dict[str, str]:
    assert difference.problems == ()
    return {
        one.subject: one.relation.value for one in difference.changes if one.relation is not Relation.EQUAL
    }


def named(difference: PolicyDifference, subject: str) -> PolicyChange:
    (found,) = [one for one in difference.changes if one.subject == subject]
    return found
