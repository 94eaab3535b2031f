"""Planning domains as JSON values for a model, and the schema of plans."""

from __future__ import annotations

import jsonschema
import pytest

from aeros.agent.planning.llm_prompt import answer_schema, describe_skill, skills_of
from aeros.spec.planning.domain import domain_for
from tests.unit.agent.dumplings import DUMPLING, site, term

DOMAIN = domain_for({"dumpling": DUMPLING}, site(), {}, term("dumpling_cooked"))


def test_a_skill_is_described_with_its_needs_and_outcomes() -> None:
    wrap = describe_skill(skills_of(DOMAIN)["dumpling.wrap"])
    assert wrap["needs"] == "dough_on_workspace and filling_on_workspace and wrapper_aligned"
    assert [(one["outcome"], one["is_failure"]) for one in wrap["outcomes"]] == [
        ("wrapped", False),
        ("misaligned", True),
    ]


@pytest.mark.parametrize(
    ("change", "is_valid"),
    [({}, True), ({"retry": 4}, False), ({"skill": "dumpling.fly"}, False), ({"on_failure": "fly"}, False)],
)
def test_the_schema_allows_the_skills_of_the_domain_alone(change: dict[str, object], is_valid: bool) -> None:
    step = {
        "skill": "dumpling.wrap",
        "inputs": {},
        "retry": 3,
        "between_tries": "recover",
        "on_failure": None,
    }
    validator = jsonschema.Draft202012Validator(answer_schema(DOMAIN, 3))
    assert validator.is_valid({"plan": [{**step, **change}]}) is is_valid
