"""Holds the checks of one module to twins of a plant: whole ones pass, broken ones are refused."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType
from typing import Any

import pytest

from aeros.sim.conformance.suite import CHECKS, Check, ConformanceError, PlantUnderTest
from tests.unit.sim.conformance.broken import BROKEN, OnItsCarriage, Twin
from tests.unit.sim.conformance.subjects import KINEMATIC, SUBJECTS


def whole_twins(module: ModuleType) -> Any:
    """Each check of a module, with each twin that is not broken."""
    checks = [check for check in CHECKS if check.__module__ == module.__name__]
    assert checks
    return [
        pytest.param(check, twin, id=f"{check.__name__}-{twin.__name__}")
        for twin in (Twin, OnItsCarriage)
        for check in checks
    ]


def broken_twins(module: ModuleType) -> Any:
    """Each check of a module, with each twin that breaks its promise, and the reason for the refusal."""
    return [
        pytest.param(check, twin, why, id=f"{check.__name__}-{twin.__name__}")
        for check in CHECKS
        if check.__module__ == module.__name__
        for twin, why in BROKEN[check.__name__].items()
    ]


def accept(check: Check, twin: type[Twin]) -> None:
    check(replace(_subject_of(twin), make_plant=twin))


def refuse(check: Check, twin: type[Twin], why: str) -> None:
    with pytest.raises(ConformanceError, match=why):
        check(replace(_subject_of(twin), make_plant=twin))


def _subject_of(twin: type[Twin]) -> PlantUnderTest:
    return SUBJECTS["kinematic on its carriage"] if issubclass(twin, OnItsCarriage) else KINEMATIC
