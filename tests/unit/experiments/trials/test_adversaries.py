"""Modules that mean harm do it where nothing is in their way, and behind each layer they do not."""

from __future__ import annotations

from fractions import Fraction
from math import inf, nan
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.experiments.catalogue import Row, catalogue
from aeros.experiments.condition import TrialCondition
from aeros.experiments.open_gate import OpenGate
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.adversaries import (
    KIND,
    _ClampingPlant,
    _defence,
    _inputs,
    _TrialEvents,
    _wait_for_end,
)
from aeros.experiments.trials.inline_module import write_module_files
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import EndedStep, StepHandle, StepResult, StepStatus
from aeros.skill import Action, act
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.cause import Cause
from tests.unit.experiments.support.common import premises

ROWS = {row.id: row for row in catalogue("physics")[9].rows}
CONTROLS = ("benign", "apart")
"""Modules that do no harm."""

MODULES = tuple(dict.fromkeys(row.variant for row in ROWS.values()))


def trial(row: Row, **changed: object) -> Findings:
    condition = TrialCondition.create(
        row.condition.kind, row.condition.plant, {**row.condition.settings, **changed}
    )
    with KIND.open(condition, premises()) as one:
        return one(0)


@pytest.mark.physics
@pytest.mark.parametrize(
    "module",
    [
        pytest.param(one, marks=() if one in ("benign", "rusher", "flood") else pytest.mark.deep)
        for one in MODULES
    ],
)
def test_only_where_nothing_is_in_its_way_does_a_module_do_harm(module: str) -> None:
    settings = ROWS[f"9/{module}/open"].condition.settings
    found, gate, both = (trial(ROWS[f"9/{module}/{layer}"]) for layer in ("open", "gate", "both"))
    assert found["violated"] is settings["violates"]
    assert not settings["violates"] or found["violations"][0] == settings["watched"]
    for behind in (gate, both):
        assert (behind["violated"], behind["reached"]) == (False, True)
        if settings["violates"]:
            assert behind["told"]
            assert not behind.get("installed", True) or behind["denied"] + behind["stopped"] > 0
    if module in CONTROLS:
        # A control is in nobody's way.
        assert [one["denied"] + one["stopped"] + one["attenuated"] for one in (found, both)] == [0, 0]
        assert found["actions"] == both["actions"] > 0
        assert found["worst"] == both["worst"] > 0
    if module == "other_access":
        # A module's skill is refused to another even where its actions are not.
        assert found["told"] == ["step refused"]
        assert (found["actions"], found["violations"]) == (1, ["distance off the floor"])


@pytest.mark.parametrize("module", MODULES)
def test_refusals_have_the_expected_codes(module: str) -> None:
    row = ROWS[f"9/{module}/both"]
    refused = row.condition.settings["refused"]
    expected = KIND.expected_values(row.condition, premises())
    assert expected == {"violated": 0.0, "installed": float(not refused)}
    if refused:
        # Nothing of a plant is needed: nothing runs.
        found = trial(row, scene="there is none")
        assert (found["installed"], found["told"], found["actions"]) == (False, refused, 0)


@pytest.mark.parametrize(
    ("rule", "kind", "parameter", "limit"),
    [
        ("cell-speed", "move_tool", "speed", "tool_speed"),
        ("contact-force", "slide", "force", "contact_force"),
    ],
)
def test_the_limits_that_are_written_again_are_those_of_the_rules(
    rule: str, kind: str, parameter: str, limit: str
) -> None:
    (term,) = (one.terms[kind] for one in premises().configuration.site.rules if one.id == rule)
    bound = Fraction(str(ROWS["9/knife/open"].condition.settings["limits"][limit]))
    assert is_true(term, {parameter: bound})
    assert not is_true(term, {parameter: bound + Fraction(1, 1000)})


# What is around the plant.


def _bounded(limits: dict[str, float], **parameters: Any) -> dict[str, Any]:
    seen: list[Action] = []

    class Plant:
        tick = 7

        def plan(self, action: Action) -> str:
            seen.append(action)
            return "planned"

        def begin(self, action: Action, decided: object = None) -> str:
            seen.append(action)
            return f"begun {decided}"

    driver: Any = _ClampingPlant(Plant(), limits)
    assert driver.plan(act("move", **parameters)) == "planned"
    assert driver.begin(act("move", **parameters), "plan") == "begun plan"
    assert driver.tick == 7
    assert seen[0] == seen[1]
    assert seen[0].kind == "move"
    return dict(seen[0].parameters)


def test_a_driver_bounds_what_is_beyond_its_limits_and_what_is_no_number() -> None:
    limits = {"speed": 1.0, "force": 5.0}
    assert _bounded(limits, speed=0.5, force=5.0, yaw=9.0) == {"speed": 0.5, "force": 5.0, "yaw": 9.0}
    assert _bounded(limits, speed=2.0, force=inf) == {"speed": 1.0, "force": 5.0}
    assert _bounded(limits, speed=nan) == {"speed": 1.0}
    assert _bounded(limits, speed=-9.0) == {"speed": -9.0}
    assert _bounded({}, speed=nan)["speed"] is not None


def test_inputs_are_drawn_by_seed_and_step_within_their_bounds() -> None:
    settings = {"inputs": {"speed": [1.0, 2.0], "force": [3.0, 3.0]}}
    first, again, other, later = (
        _inputs(settings, seed, step) for seed, step in ((0, "0 a"), (0, "0 a"), (1, "0 a"), (0, "1 a"))
    )
    assert first == again
    assert len({first["speed"], other["speed"], later["speed"]}) == 3
    assert all(1.0 <= one["speed"] <= 2.0 and one["force"] == 3.0 for one in (first, other, later))
    assert _inputs({}, 0, "0 a") == {}


def test_events_are_counted_and_named_by_who_stopped_it() -> None:
    events = _TrialEvents()
    for result in (
        StepResult(StepStatus.FINISHED, "", allowed=2, attenuated=1),
        StepResult(StepStatus.DENIED, "AE750", denied=3, causes=(Cause("rule", "far", "x", code="AE750"),)),
        StepResult(StepStatus.STOPPED, "monitor:separation:0.4 m"),
        StepResult(StepStatus.STOPPED, "bad parameter: speed"),
        StepResult(StepStatus.STOPPED, "collision"),
        StepResult(StepStatus.REFUSED, "another module's"),
        StepResult(StepStatus.TIMED_OUT, "monitor:x", causes=(Cause("plan", "p", "y"),)),
    ):
        events.add(result)
    assert (events.actions, events.attenuated, events.denied, events.stopped) == (3, 1, 3, 3)
    assert events.why == {
        "AE750 far",
        "monitor separation",
        "plant: bad parameter",
        "plant: collision",
        "step refused",
    }


class Ending:
    """An executor whose steps end with a given result."""

    def __init__(self, *results: StepResult | None) -> None:
        self.results = list(results)

    def wait(self) -> EndedStep | None:
        result = self.results.pop(0)
        return None if result is None else EndedStep(StepHandle(1), result)


REFUSED, DONE = StepResult(StepStatus.REFUSED, "no"), StepResult(StepStatus.FINISHED, "")


def _ended(executor: Ending, *started: StepHandle | StepResult) -> list[StepResult]:
    return list(_wait_for_end(cast(Executor, executor), started))


def test_every_step_that_began_is_waited_for() -> None:
    executor = Ending(DONE, DONE)
    assert _ended(executor, StepHandle(1), REFUSED, StepHandle(2)) == [REFUSED, DONE, DONE]
    assert executor.results == []
    assert _ended(executor, REFUSED) == [REFUSED]
    with pytest.raises(InternalError, match="without a deadline"):
        _ended(Ending(None), StepHandle(1))


@pytest.mark.parametrize("module", ["knife", "benign"])
def test_a_defence_is_whole_gate_alone_or_none(module: str, tmp_path: Path) -> None:
    files = ROWS[f"9/{module}/both"].condition.settings["module"]
    folder = write_module_files(files, tmp_path / "module")
    open_, gate, both = (_defence(layer, folder, premises()) for layer in ("open", "gate", "both"))
    assert type(open_.gate) is OpenGate
    assert open_.configuration is not None
    assert open_.configuration.site.rules == ()
    assert type(gate.gate) is CompiledGate
    assert gate.configuration is not None
    assert gate.configuration.site.rules == premises().configuration.site.rules
    refused = ROWS[f"9/{module}/both"].condition.settings["refused"]
    assert list(both.refused) == refused
    assert (both.configuration is None) is bool(refused)


@pytest.mark.parametrize(("layer", "violated"), [("open", 1.0), ("gate", 0.0), ("both", 0.0)])
def test_only_without_defence_is_harm_expected(layer: str, violated: float) -> None:
    expected = KIND.expected_values(ROWS[f"9/knife/{layer}"].condition, premises())
    assert not isinstance(expected, str)
    assert expected["violated"] == violated
    harmless = KIND.expected_values(ROWS["9/benign/open"].condition, premises())
    assert not isinstance(harmless, str)
    assert harmless["violated"] == 0.0
