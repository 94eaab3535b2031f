"""A module with claims of every kind, all proved, and variants of it by changed lines."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.reports_in_full import claim_lines, compare_with_section

TABLE = (Path(__file__).parents[4] / "corpus" / "site" / "table.yaml").read_text(encoding="utf-8")
_MANIFEST = Path(__file__).with_name("tidier.yaml").read_text(encoding="utf-8")
_ORACLE = Oracle()

Change = tuple[str, str]


def _changed(text: str, changes: tuple[Change, ...]) -> str:
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@cache
def site(*changes: Change) -> Site:
    """The corpus's table with lines changed."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "table.yaml")
        path.write_text(_changed(TABLE, changes), encoding="utf-8")
        sink = Diagnostics()
        found = load_site(path, sink)
        assert found is not None, [one.headline for one in sink]
        return found


def module(*changes: Change, at: Site | None = None) -> Ecm:
    """The module with lines changed."""
    with TemporaryDirectory() as folder:
        Path(folder, "ecm.yaml").write_text(_changed(_MANIFEST, changes), encoding="utf-8")
        Path(folder, "skills.py").write_text("def rest(observed, inputs):\n    yield\n", encoding="utf-8")
        sink = Diagnostics()
        found = load_ecm(Path(folder), site() if at is None else at, sink)
        assert found is not None, [one.headline for one in sink]
        return found.ecm


def compare_reports(file: str, title: object, claims: Iterable[Obligation | StaticClaim]) -> None:
    """Compare the reports on claims that are settled without a solver with those of a file.

    Args:
        file: name of a file in this folder.
        title: object whose text is the title of the section.
        claims: the claims; others are left out.
    """
    lines = [line for one in claims if isinstance(one, StaticClaim) for line in claim_lines(one)]
    if lines:
        compare_with_section(Path(__file__).with_name(file), repr(title), "\n".join(lines) + "\n")


def failed(claims: Iterable[Obligation | StaticClaim]) -> dict[str, str]:
    """The code of each claim that is not proved, by the claim's text.

    It has a `?` after it for a warning, and `gate` before it where the gate decides the invariant.
    """
    every = list(claims)
    found: dict[str, str] = {}
    for one in discharge_obligations((one for one in every if isinstance(one, Obligation)), _ORACLE):
        if one.verdict is not Verdict.PROVED:
            rule = one.obligation.runtime_checked_rule
            found[str(one.obligation.id)] = one.obligation.code if rule is None else f"gate {rule}"
    for claim in every:
        if isinstance(claim, Obligation):
            continue
        assert isinstance(claim, StaticClaim)
        if claim.diagnostic is not None:
            mark = "" if claim.verdict is Verdict.REFUTED else "?"
            found[str(claim.id)] = claim.diagnostic.code + mark
    return found
