"""Claims go by name: certificates list them, so a name that changes makes every certificate stale.

AEROS_UPDATE_GOLDEN=1 pytest tests/unit/spec/obligations/test_claim_names.py   rewrites `names.txt`, and fails
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from aeros.spec.verification.verify import verify

CORPUS = Path(__file__).parents[3] / "corpus"
NAMES = Path(__file__).parent / "data" / "names.txt"
CASES = (
    "accepted/both_together_just_slow_enough",
    "accepted/handler_that_leads_back",
    "accepted/input_that_keeps_the_sum_low",
    "accepted/invariant_kept_through_failures",
    "accepted/modules_that_need_each_other_in_one_direction",
    "accepted/words_side_by_side",
    "rejected/closed_loop/rules_over_numbers",
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
        NAMES.write_text(shown, encoding="utf-8")
        pytest.fail("the golden file was rewritten: read the difference, then run without the variable")
    assert shown == NAMES.read_text(encoding="utf-8")
