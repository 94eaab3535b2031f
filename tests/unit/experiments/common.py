"""What tests of experiments begin with."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from aeros.experiments.architecture import Model
from aeros.experiments.condition import Condition
from aeros.experiments.failure_models import failing
from aeros.experiments.inputs import Premises, Where, premises_of
from aeros.experiments.trial_kinds import VARYING, Found

ROOT = Path(__file__).parents[3]
WHERE = Where(str(ROOT / "ecms"))

_P = ParamSpec("_P")
_R = TypeVar("_R")

FAILURES: Mapping[str, tuple[str, str, str]] = {
    "make_dumplings": ("wrap", "not_sealed", "3/10"),
    "clean_table": ("wipe", "streaky", "2/5"),
    "fetch_object": ("detect", "not_seen", "7/20"),
}


def premises() -> Premises:
    return premises_of(WHERE)


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


def condition(**changed: Any) -> Condition:
    return Condition.of("task", "symbolic", settings(**changed))


def model(**changed: Any) -> Model:
    given = settings(**changed)
    routed = premises().routed(given["task"])
    ecm = failing(premises().configuration.modules[routed.module], given)
    return Model(ecm, replace(routed.task, invariants=()), premises().configuration.site)


def told(found: Found, *but: str) -> dict[str, Any]:
    """What was found, but for what may differ from one time to the next, and `but` these."""
    return {name: value for name, value in found.items() if name not in (*VARYING, *but)}


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
