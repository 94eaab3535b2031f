"""The module `counts_and_ranges` of the corpus: outcomes that count, and that leave a thing in a range."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from typing import Any

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.planning.domain import PlanningDomain, domain_for
from tests.unit.spec.faults import CORPUS, TABLE

ID = "counts_and_ranges"
WASHED, NUMBER, AT_EDGE, PLACE = (
    f"{ID}.{name}" for name in ("washed", "number", "sponge_at_edge", "sponge_position")
)


@cache
def counting() -> tuple[Ecm, Site]:
    """The module, and the site with its variables."""
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    loaded = load_ecm(CORPUS / "accepted" / ID, site, Diagnostics())
    assert loaded is not None
    return loaded.ecm, site.with_modules([loaded.ecm])


def counting_domain(number: int, known: Mapping[str, Any] | None = None) -> PlanningDomain:
    """The planning domain of its task, for so many tools."""
    ecm, site = counting()
    values = {WASHED: Fraction(0), AT_EDGE: False, **(known or {}), NUMBER: Fraction(number)}
    return domain_for({ID: ecm}, site, values, ecm.tasks["wash"].goal)
