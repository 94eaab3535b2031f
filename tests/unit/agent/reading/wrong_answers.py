"""The wrong answers of `wrong_answers.yaml`, as a server sends them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import yaml

from aeros.spec.elaborate.scopes import argument_scope
from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import Ecm, TaskInvariant
from aeros.spec.model.site import Site
from tests.unit.agent.dumplings import SPAN

Case = Mapping[str, Any]

WRONG_ANSWERS: Final[Mapping[str, Case]] = {
    case["name"]: case
    for case in yaml.safe_load((Path(__file__).parent / "wrong_answers.yaml").read_text(encoding="utf-8"))
}


def step(skill: str) -> dict[str, Any]:
    return {"skill": skill, "inputs": {}, "retry": 0, "between_tries": None, "on_failure": None}


def answer_of(case: Case) -> Any:
    """The answer, as text or as JSON values."""
    if "text" in case:
        return case["text"]
    if "repeat" in case:
        text, times = case["repeat"]
        return text * times
    if "nested_goal" in case:
        depth = case["nested_goal"]
        goal = "(" * depth + "dumpling_cooked" + ")" * depth
        case = {
            "requests": [
                {"task": "make_dumplings.make_dumplings", "arguments": {}, "goal": goal, "plan": []}
            ],
            "words": [[case["instruction"], "request 1"]],
        }
    return {
        "requests": [
            {
                "condition": None,
                "arguments": {},
                **request,
                "plan": [step(skill) for skill in request["plan"]],
            }
            for request in case["requests"]
        ],
        "prohibited": case.get("prohibited", []),
        "words": [{"phrase": phrase, "accounts_for": part} for phrase, part in case["words"]],
    }


def modules_of(case: Case, modules: Mapping[str, Ecm], site: Site) -> Mapping[str, Ecm]:
    """The modules, with the invariant or the injected text that the case gives them."""
    module = modules["make_dumplings"]
    task = module.tasks["make_dumplings"]
    if "invariant" in case:
        term = check(parse(case["invariant"]), argument_scope(site), BOOL)
        task = replace(task, invariants=(TaskInvariant("kept", term, case["invariant"], SPAN),))
    if "injected" in case:
        task = replace(task, trigger_phrases=(*task.trigger_phrases, case["injected"]))
    return {**modules, "make_dumplings": replace(module, tasks={**module.tasks, "make_dumplings": task})}
