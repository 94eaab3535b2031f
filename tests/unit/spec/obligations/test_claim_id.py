"""Identities of claims: two that differ never have one text, whatever names authors and operators choose.

Certificates list claims by their texts, so a text that changes makes every certificate stale.

AEROS_UPDATE_GOLDEN=1 pytest tests/unit/spec/obligations/test_claim_id.py   rewrites `names.txt`, and fails
"""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.obligations.claim_id import (
    CLAIM_FORMS,
    ClaimForm,
    ClaimId,
    ClaimPattern,
    claim_form,
    fits_slot,
)
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


def test_the_parts_of_a_pattern_are_its_words_and_slots() -> None:
    pattern = ClaimPattern("form/code/{path}/line-{number}/gated-{invariant}")
    parts = [("form", ""), ("code", ""), ("", "path"), ("line-", "number"), ("gated-", "invariant")]
    assert [(one.word, one.slot) for one in pattern.segments] == parts
    assert pattern.slots == ("path", "number", "invariant")
    assert pattern.checked_slots == ((0, "path"), (1, "number"))
    assert pattern.group == "form"
    assert pattern.format == "form/code/%s/line-%s/gated-%s"


def test_a_pattern_has_the_name_that_it_is_listed_under_and_rivals_among_the_kinds() -> None:
    class Forms:
        START = ClaimPattern("safety/{skill}/can-start")

    assert Forms.START.name == "START"
    rivals = {form for _, _, form in Forms.START.rivals}
    assert ClaimForm.SKILL_CAN_START in rivals
    assert ClaimForm.GOAL_EFFECTIVE not in rivals


def test_a_kind_of_claim_has_the_name_of_its_member_and_stays_one_in_another_process() -> None:
    for form in CLAIM_FORMS:
        assert getattr(ClaimForm, form.name) is form is claim_form(form.name)
        assert repr(form) == f"ClaimForm.{form.name}"
        assert copy.copy(form) is form  # as another process that reads it
    for name in ("NOTHING", "__doc__"):
        with pytest.raises(KeyError, match=name):
            claim_form(name)


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


CORPUS = Path(__file__).parents[3] / "corpus"
GOLDEN = Path(__file__).parent / "data" / "names.txt"
CASES = (
    "accepted/both_together_just_slow_enough",
    "accepted/capability_with_an_interface",
    "accepted/handler_that_leads_back",
    "accepted/input_that_keeps_the_sum_low",
    "accepted/invariant_kept_through_failures",
    "accepted/modules_that_need_each_other_in_one_direction",
    "accepted/words_side_by_side",
    "rejected/closed_loop/rules_over_two_angles",
    "rejected/composition/both_branches_turn_the_table",
    "rejected/composition/case_without_a_branch",
    "rejected/composition/more_paths_than_are_explored",
    "rejected/composition/person_comes_when_both_have_begun",
    "rejected/composition/retry_after_a_handler_that_undoes",
    "rejected/configuration/two_versions_needed",
)


def _lines() -> Iterator[str]:
    for number, case in enumerate(CASES):
        report = verify([CORPUS / case], CORPUS / "site" / "table.yaml")
        for subject in report.subjects[1 if number else 0 :]:  # the site is the same for all
            yield f"{case}: {subject.name}"
            claims = [one.obligation.id for one in subject.findings] + [
                one.id for one in subject.static_claims
            ]
            names = list(map(str, claims))
            assert len(names) == len(set(names))
            yield from (f"  {name}" for name in sorted(names))


def test_every_claim_has_a_name_of_its_own_that_stays() -> None:
    shown = "\n".join(_lines()) + "\n"
    if os.environ.get("AEROS_UPDATE_GOLDEN") == "1":
        GOLDEN.write_text(shown, encoding="utf-8")
        pytest.fail("the golden file was rewritten: read the difference, then run without the variable")
    assert shown == GOLDEN.read_text(encoding="utf-8")
