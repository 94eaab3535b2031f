from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import pytest

import aeros
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.summary import summarize_module
from aeros.spec.obligations.dependencies import dependency_obligations, runtime_obligations

CORPUS = Path(__file__).parents[3] / "corpus"


@pytest.fixture(scope="module")
def ecm() -> Ecm:
    site = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert site is not None
    found = load_ecm(CORPUS / "accepted" / "always_slow", site, Diagnostics())
    assert found is not None
    return found.ecm


def faults(ecm: Ecm, *around: Ecm) -> list[str]:
    own = summarize_module(ecm)
    found = (
        *runtime_obligations(own),
        *dependency_obligations(own, {one.id: summarize_module(one) for one in around}),
    )
    return [one.diagnostic.code for one in found if one.diagnostic is not None]


def needing(ecm: Ecm, **requires: str) -> Ecm:
    return replace(ecm, required_modules=requires, requires_spans=dict.fromkeys(requires, ecm.span))


def test_a_version_before_its_release_counts(ecm: Ecm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aeros, "__version__", "0.5.0.dev3")
    assert faults(replace(ecm, required_aeros_version=">=0.4")) == []
    assert faults(replace(ecm, required_aeros_version=">=0.5")) == ["AE304"]
    helper = replace(ecm, id="helper", version="2.0.0rc1")
    assert faults(needing(ecm, helper=">=1.5"), helper) == []
    assert faults(needing(ecm, helper=">=2"), helper) == ["AE302"]


def test_a_circle_is_found_wherever_in_it_the_module_stands(ecm: Ecm) -> None:
    first, second = needing(replace(ecm, id="first"), second=""), needing(replace(ecm, id="second"), first="")
    outside = needing(replace(ecm, id="outside"), first="")
    assert faults(first, second) == ["AE303"]
    assert faults(second, first) == ["AE303"]
    assert faults(outside, first, second) == []  # the cycle is theirs, and reported for them
    assert faults(needing(outside, third="", first=""), first, second, replace(ecm, id="third")) == []
    tail = needing(replace(ecm, id="tail"), leaf="", head="")
    head, leaf = needing(replace(ecm, id="head"), tail=""), replace(ecm, id="leaf")
    assert faults(tail, head, leaf) == ["AE303"]  # though the first that it needs leads nowhere


def test_a_capability_is_refused_exactly_where_no_module_provides_it_in_the_range(ecm: Ecm) -> None:
    versions = (None, "1.1.9", "1.2.0", "1.3.0", "2.0.0")
    asker = replace(
        ecm, required_capabilities={"grasping": ">=1.2,<2"}, capability_spans={"grasping": ecm.span}
    )
    for first, second in itertools.product(versions, repeat=2):
        around = [
            replace(ecm, id=name, capability_versions={"other": "1.2.0"} | ({"grasping": one} if one else {}))
            for name, one in (("first", first), ("second", second))
        ]
        provided = [one for one in (first, second) if one is not None]
        suits = any(one in ("1.2.0", "1.3.0") for one in provided)
        expected = [] if suits else ["AE306"] if provided else ["AE305"]
        assert faults(asker, *around) == expected
