"""Claims about effects on quantities are proved exactly where they hold for every value."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.outcomes.effects import effect_claims
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.unit.spec.faults import CORPUS, TABLE

MANIFEST = (CORPUS / "accepted" / "counts_and_ranges" / "ecm.yaml").read_text(encoding="utf-8")


def refused(tmp_path: Path, *edits: tuple[str, str]) -> set[str]:
    """Codes of the claims that fail for the module of the corpus after these edits."""
    text = MANIFEST
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    folder = tmp_path / "module"
    folder.mkdir(exist_ok=True)
    (folder / "ecm.yaml").write_text(text, encoding="utf-8")
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    loaded = load_ecm(folder, site, Diagnostics())
    assert loaded is not None
    codes: set[str] = set()
    asked: list[Obligation] = []
    for claim in effect_claims(loaded.ecm, site.with_modules([loaded.ecm])):
        if isinstance(claim, Obligation):
            asked.append(claim)
        elif claim.diagnostic is not None:
            codes.add(claim.diagnostic.code)
    results = discharge_obligations(asked)
    return codes | {one.obligation.code for one in results if one.verdict is not Verdict.PROVED}


def test_an_effect_is_refused_exactly_where_some_value_breaks_it(tmp_path: Path) -> None:
    refusals = 0
    for amount, relation, bound in product((-2, -1, 1, 2), ("<", ">="), (1, 2, 3)):
        starts = [n for n in range(4) if (n < bound if relation == "<" else n >= bound)]
        breaks = any(not 0 <= n + amount <= 3 for n in starts)
        effect = f"washed: {'+' if amount > 0 else '-'}= {abs(amount)}"
        edits = (("washed < 3", f"washed {relation} {bound}"), ("washed: += 1", effect))
        assert (refused(tmp_path, *edits) == {"AE512"}) is breaks, edits
        refusals += breaks
    assert 6 < refusals < 20
    refusals = 0
    for (low, high), at_edge in product(((380, 389), (380, 390), (390, 400)), (True, False)):
        fits = any((y >= 390) is at_edge for y in range(low, high + 1))
        edits = (
            ("in [395 mm, 420 mm]", f"in [{low} mm, {high} mm]"),
            ("sponge_at_edge: true", f"sponge_at_edge: {str(at_edge).lower()}"),
        )
        assert (refused(tmp_path, *edits) == set()) is fits, edits
        refusals += not fits
    assert refusals == 2


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("          sponge_at_edge: true\n", ""),
        (
            "  sponge_at_edge: {",
            "  many: {type: bool, max_age: 1 s, definition: washed >= 2}\n  sponge_at_edge: {",
        ),
        (
            "\nperceivers:",
            "  sponge_off_edge: {type: bool, max_age: 1 s, definition: not sponge_at_edge}\n\nperceivers:",
        ),
    ],
)
def test_a_predicate_that_follows_from_a_change_has_to_be_declared(
    tmp_path: Path, old: str, new: str
) -> None:
    assert refused(tmp_path) == set()
    assert refused(tmp_path, (old, new)) == {"AE513"}
