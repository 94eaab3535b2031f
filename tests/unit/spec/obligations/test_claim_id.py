"""Identities of claims: two that differ never have one text, whatever names authors and operators choose."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.obligations.claim_id import CLAIM_FORMS, ClaimForm, ClaimId, ClaimPattern, fits_slot
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.verify import verify

CLASHING = Path(__file__).parents[2] / "runtime" / "data" / "clashing_names"

WORDS = sorted({segment.word for form in CLAIM_FORMS for segment in form.segments})
"""All fixed words and prefixes of patterns, the empty one included."""

NAMES = st.one_of(
    st.sampled_from(WORDS),
    st.sampled_from(["move", "1", "gated-move", "if-1", "par-1", "a/b", "%2F", "=", "skill=goal", "x.py"]),
    st.text(alphabet="a/=%-1.", max_size=4),
)


def _name_for(slot: str) -> st.SearchStrategy[str]:
    if slot == "path":
        return st.lists(NAMES, max_size=2).map(lambda parts: "/".join([*parts, "a.py"]))
    return NAMES if fits_slot(slot, "move") else st.sampled_from(["1", "2"])


def _claim_ids(form: ClaimPattern) -> st.SearchStrategy[ClaimId]:
    return st.tuples(*map(_name_for, form.slots)).map(lambda names: ClaimId(form, names))


def _of_group(group: str) -> st.SearchStrategy[ClaimId]:
    return st.sampled_from([form for form in CLAIM_FORMS if form.group == group]).flatmap(_claim_ids)


GROUPS = sorted({form.group for form in CLAIM_FORMS})


@given(st.sampled_from(GROUPS).flatmap(lambda group: st.sets(_of_group(group), min_size=2, max_size=16)))
def test_claims_that_differ_have_texts_that_differ(claim_ids: set[ClaimId]) -> None:
    assert len({str(one) for one in claim_ids}) == len(claim_ids)


@given(st.lists(st.sampled_from(CLAIM_FORMS).flatmap(_claim_ids), min_size=2, max_size=2, unique=True))
def test_claims_of_any_two_groups_have_texts_that_differ(pair: list[ClaimId]) -> None:
    one, other = pair
    assert str(one) != str(other)


@pytest.mark.parametrize("form", CLAIM_FORMS, ids=repr)
def test_ordinary_names_stand_in_the_pattern_as_they_are(form: ClaimPattern) -> None:
    names = [
        {"path": "code/skills.py", "number": "1", "case": "2"}.get(slot, f"some_{slot}")
        for slot in form.slots
    ]
    assert str(form(*names)) == form.value.format(**dict(zip(form.slots, names, strict=True)))


@pytest.mark.parametrize(
    ("claim_id", "text"),
    [
        (ClaimForm.GOAL_EFFECTIVE("move"), "safety/goal/move/effective"),
        (
            ClaimForm.ENVELOPE_OBEYS("goal", "move", "effective"),
            "safety/skill=goal/action=move/invariant=effective",
        ),
        (ClaimForm.ENVELOPE_OBEYS("goal", "move", "force"), "safety/goal/move/force"),
        (ClaimForm.ENVELOPE_OBEYS("a", "move", "not-dead"), "safety/skill=a/action=move/invariant=not-dead"),
        (ClaimForm.RUNTIME_SUITS(), "dependencies/runtime"),
        (ClaimForm.DEPENDENCY_MET("runtime"), "dependencies/module=runtime"),
        (
            ClaimForm.RULE_EFFECTIVE("joint", "satisfiable"),
            "policy/action=joint/effective/invariant=satisfiable",
        ),
        (ClaimForm.DIFFERENCE("policy/access", "a=b%"), "difference/policy%2Faccess/a%3Db%25"),
    ],
    ids=str,
)
def test_of_two_claims_with_one_plain_text_one_keeps_it(claim_id: ClaimId, text: str) -> None:
    assert str(claim_id) == text


def test_a_claim_takes_a_name_for_each_slot_of_its_form() -> None:
    claim_id = ClaimForm.ENVELOPE_OBEYS("wrap", "move", "force")
    assert [claim_id.name_of(slot) for slot in claim_id.form.slots] == ["wrap", "move", "force"]
    assert claim_id.group == "safety"
    with pytest.raises(MisuseError, match="has no `task`"):
        claim_id.name_of("task")
    with pytest.raises(MisuseError, match="takes 3 names, not 1"):
        ClaimForm.ENVELOPE_OBEYS("wrap")
    with pytest.raises(MisuseError, match="is no number"):
        ClaimForm.IF_COVERS("tidy", "first")
    with pytest.raises(MisuseError, match="is no path"):
        ClaimForm.CODE_REACHES_NOTHING("skills.py/asking")


def test_every_claim_of_a_module_whose_names_clash_is_in_its_certificate() -> None:
    report = verify([CLASHING], CLASHING / "site.yaml")
    assert report.conclusion is Conclusion.PROVED
    (module,) = report.modules
    assert module.certificate is not None
    written = json.loads(module.certificate.text())["obligations"]
    assert len(written) == module.claim_count == len({one.id for one in module.claims})
    assert written["safety/goal/move/effective"] == "PROVED"
    assert written["safety/skill=goal/action=move/invariant=effective"] == "GUARDED"
    assert "effective" in module.certificate.runtime_checked_rules("goal", "move")
