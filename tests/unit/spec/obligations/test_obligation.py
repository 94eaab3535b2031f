"""Obligations and the conditions that their reports point at."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.site import Site
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.joint import joint_policy_obligations
from aeros.spec.obligations.obligation import (
    LabelledConjunct,
    Obligation,
    VariableSpace,
    label_conjuncts,
    rule_conjuncts,
)
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.policy import policy_obligations
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from tests.reports_in_full import claim_lines, compare_with_file
from tests.unit.agent.dumplings import STATE, term
from tests.unit.spec.obligations.data.tidier import module, site

CORPUS = Path(__file__).parents[3] / "corpus"
SPAN = Source("text", "0123456789").span(2, 5)


def test_the_variables_of_a_space_are_found_by_name() -> None:
    space = VariableSpace((STATE["area"], STATE["tool"]), ())
    assert dict(space.by_name) == {"area": STATE["area"], "tool": STATE["tool"]}
    assert dict(VariableSpace((), ()).by_name) == {}


def test_each_conjunct_is_labelled_at_its_own_place() -> None:
    parts = [Conjunct(term("dumpling_cooked"), SPAN), Conjunct(t.TRUE, SPAN)]
    assert label_conjuncts(parts, "clashes") == (
        LabelledConjunct(term("dumpling_cooked"), SpanLabel(SPAN, "clashes")),
        LabelledConjunct(t.TRUE, SpanLabel(SPAN, "clashes")),
    )
    assert label_conjuncts([], "clashes") == ()


def test_the_conjuncts_of_rules_are_labelled_with_the_rule_that_requires_them() -> None:
    rules = site().rules
    texts = [(one.label.text, one.label.span.text) for one in rule_conjuncts(rules, "drive")]
    assert texts == [
        ("required by `stop-button`", "not stop_pressed"),
        ("required by `some-joint-ready`", "any(joint_ready[j] for j in joints)"),
        ("required by `short-drive`", "-1 m <= distance_driven"),
        ("required by `short-drive`", "distance_driven <= 1 m"),
    ]
    assert rule_conjuncts(rules, "nothing") == ()


FURTHER = (
    "accepted/attenuation_of_a_vector",
    "accepted/capability_by_a_sequence_or_a_composition",
    "accepted/case_of_every_member",
    "accepted/counts_and_ranges",
    "accepted/definition_of_definitions",
    "accepted/held_and_timed_parts",
    "rejected/composition/composed_step_that_may_not_start",
    "rejected/composition/last_handler_that_may_not_start",
    "rejected/composition/step_after_a_stop_that_may_not_start",
    "rejected/safety/hold_that_success_excludes",
    "rejected/site/contact_speed_that_no_rule_keeps",
    "rejected/site/stop_denied_by_its_past",
)
"""Cases of the corpus with claims of other kinds than those about the module `tidier`."""


def _claims_of_case(folder: Path, place: Site) -> Iterator[Obligation | StaticClaim]:
    if (folder / "site.yaml").exists():
        other = load_site(folder / "site.yaml", Diagnostics())
        assert other is not None
        yield from policy_obligations(other)
        return
    loaded = load_ecm(folder, place, Diagnostics())
    assert loaded is not None
    whole = place.with_modules(loaded.ecm.with_owners)
    yield from safety_obligations(loaded.ecm, whole)
    yield from composition_obligations(loaded.ecm, whole)


def test_two_claims_of_each_kind_in_full() -> None:
    place, ecm = site(), module()
    claims = [
        *policy_obligations(place),
        *joint_policy_obligations(place),
        *permission_obligations(ecm, place),
    ]
    claims += [*safety_obligations(ecm, place), *composition_obligations(ecm, place)]
    claims += [one for case in FURTHER for one in _claims_of_case(CORPUS / case, place)]
    lines: list[str] = []
    seen: Counter[str] = Counter()
    for one in claims:
        if isinstance(one, Obligation):
            seen[one.id.form.value] += 1
            lines += claim_lines(one) if seen[one.id.form.value] <= 2 else ()
    compare_with_file(Path(__file__).with_name("data") / "claims.txt", "\n".join(lines) + "\n")
