"""Fixtures that tests of experiments share."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from aeros.experiments.architecture import TrialModel
from aeros.experiments.condition import TrialCondition
from aeros.experiments.failure_models import module_with_failure_rate
from aeros.experiments.inputs import InputPaths, TrialInputs, load_inputs
from aeros.experiments.trial_kinds import NONDETERMINISTIC_FIELDS, Findings

ROOT = Path(__file__).parents[4]
WHERE = InputPaths(str(ROOT / "ecms"))

_P = ParamSpec("_P")
_R = TypeVar("_R")

FAILURES: Mapping[str, tuple[str, str, str]] = {
    "make_dumplings": ("wrap", "not_sealed", "3/10"),
    "clean_table": ("wipe", "streaky", "2/5"),
    "fetch_object": ("detect", "not_seen", "7/20"),
}


def premises() -> TrialInputs:
    return load_inputs(WHERE)


def settings(
    task: str = "make_dumplings",
    architecture: str = "flat",
    options: Mapping[str, Any] | None = None,
    policy: bool = True,
    **changed: Any,
) -> dict[str, Any]:
    skill, outcome, rate = FAILURES[task]
    return {
        "task": task,
        "architecture": architecture,
        "options": dict(options or {}),
        "policy": policy,
        "skill": skill,
        "outcome": outcome,
        "rate": rate,
        **changed,
    }


def condition(**changed: Any) -> TrialCondition:
    return TrialCondition.create("task", "symbolic", settings(**changed))


def model(**changed: Any) -> TrialModel:
    given = settings(**changed)
    routed = premises().routed(given["task"])
    ecm = module_with_failure_rate(premises().configuration.modules[routed.module], given)
    return TrialModel(ecm, replace(routed.task, invariants=()), premises().configuration.site)


def comparable_findings(found: Findings, *but: str) -> dict[str, Any]:
    """Return the findings without those that may differ between runs, and without `but`."""
    return {name: value for name, value in found.items() if name not in (*NONDETERMINISTIC_FIELDS, *but)}


def groups(svg: str, name: str) -> list[ET.Element]:
    """The groups of a figure that are called so."""
    return ET.fromstring(svg).findall(f".//{{*}}g[@id='{name}']")  # noqa: S314 - our own output


def marks(svg: str, name: str) -> list[ET.Element]:
    """The points in the groups of a figure that are called so."""
    return [mark for group in groups(svg, name) for mark in group.findall(".//{*}use")]


class Here(Executor):
    """An executor that runs everything in this process, at once."""

    def __init__(self) -> None:
        self.submitted = 0

    def submit(self, fn: Callable[_P, _R], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_R]:
        self.submitted += 1
        future: Future[_R] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except BaseException as error:
            future.set_exception(error)
        return future
