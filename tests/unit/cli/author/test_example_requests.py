"""Example requests: allowed by the gate, with doubles where the witness is rational."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import pytest

from aeros.cli.author.example_requests import example_requests
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import Readings
from aeros.runtime.proving import prove_configuration
from aeros.skill import Action
from aeros.spec.backends.answer_store import open_default_store
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import verify
from tests.unit.runtime.bench import MODULE, SITE, configuration, gate


@cache
def full() -> Report:
    """The verification of the bench with its witnesses."""
    with open_default_store() as store:
        return verify([MODULE], SITE, store=store)


class Refusing(CompiledGate):
    """A gate that denies the first requests, and then asks another."""

    def __init__(self, denials: int, of: DecisionKind = DecisionKind.DENY) -> None:
        super().__init__(configuration())
        self.left, self.kind, self.asked = denials, of, 0

    def decide(self, caller: Caller, readings: Readings, action: Action, now: float, usage: Any) -> Decision:
        self.asked += 1
        self.left -= 1
        if self.left >= 0:
            return Decision(self.kind, action if self.kind is DecisionKind.ATTENUATE else None, ())
        return super().decide(caller, readings, action, now, usage)


def examples(skill: str, by: Gate | None = None) -> list[dict[str, Any]]:
    site, ecm = configuration().site, configuration().modules["handling"]
    return [json.loads(one) for one in example_requests(by or gate(), site, ecm, ecm.skills[skill], full())]


@pytest.mark.parametrize(
    ("skill", "kinds"),
    [("slowly", ["move", "carry", "stop"]), ("quickly", ["move", "carry", "sweep"]), ("paced", ["carry"])],
)
def test_there_is_a_request_for_each_kind_of_the_envelope(skill: str, kinds: list[str]) -> None:
    assert [one["action"]["kind"] for one in examples(skill)] == kinds


def test_a_request_has_all_that_the_gate_reads_at_one_time_and_no_usage() -> None:
    (carry,) = examples("paced")
    assert carry["time"] == 10.0
    assert carry["state"].keys() == configuration().site.observed_variables.keys()
    assert {one["time"] for one in carry["state"].values()} == {10.0}
    assert carry["usage"] == {"carry-rate": 0}
    assert carry["inputs"]["tool"] == "brush"  # its envelope asks for it
    assert carry["inputs"]["limit"] <= 0.1


def test_a_value_that_no_proof_depends_on_is_in_the_middle_of_its_range() -> None:
    stop = examples("slowly")[-1]
    state = {name: one["value"] for name, one in stop["state"].items()}
    assert (state["human_distance"], state["load"], state["wind"]) == (10.0, 2.5, 10.0)
    assert (state["joint_angle"], state["hand"]) == ([0.0, 0.0], [0.0, 0.0, 0.0])
    assert (state["fitted"], state["joint_ready"]) == ("brush", [False, False])
    assert stop["action"]["parameters"] == {}


@pytest.mark.parametrize("kind", [DecisionKind.DENY, DecisionKind.ATTENUATE])
def test_another_candidate_is_tried_until_one_is_allowed(kind: DecisionKind) -> None:
    refusing = Refusing(7, kind)
    assert len(examples("paced", refusing)) == 1
    assert refusing.asked >= 8


def test_a_kind_of_which_no_candidate_is_allowed_has_no_example() -> None:
    refusing = Refusing(10_000)
    assert examples("slowly", refusing) == []
    assert refusing.asked == 3 * 200


def test_a_skill_without_actions_has_no_example() -> None:
    site, ecm = configuration().site, configuration().modules["handling"]
    idle = replace(ecm.skills["slowly"], envelope={})
    assert list(example_requests(gate(), site, ecm, idle, full())) == []


def test_whole_numbers_are_in_the_middle_rounded_down() -> None:
    paths, at = [SITE.parent / "counting"], SITE.parent / "counts.yaml"
    counted, _ = prove_configuration(paths, at, certified=False)
    ecm = counted.modules["counting"]
    with open_default_store() as store:
        witness = verify(paths, at, store=store)
    blank = replace(witness, modules=())  # no witness names a value
    deny = Denying(counted)
    assert list(example_requests(deny, counted.site, ecm, ecm.skills["feed"], blank)) == []
    first = deny.seen[0]
    state = {name: reading.value for name, reading in first.readings.items()}
    assert (state["pieces"], state["filled"], state["pressed"]) == (4, [4, 4], False)
    assert first.action.parameters == {"many": 4, "speed": 2.5}
    assert first.caller.inputs == {"most": 2}
    (line,) = example_requests(CompiledGate(counted), counted.site, ecm, ecm.skills["feed"], witness)
    assert json.loads(line)["action"]["parameters"]["many"] <= 5


class Asked(NamedTuple):
    """A request to a gate."""

    caller: Caller
    readings: Readings
    action: Action


class Denying(CompiledGate):
    """A gate that keeps what it was asked, and denies it."""

    def __init__(self, configuration: Configuration) -> None:
        super().__init__(configuration)
        self.seen: list[Asked] = []

    def decide(self, caller: Caller, readings: Readings, action: Action, now: float, usage: Any) -> Decision:
        self.seen.append(Asked(caller, readings, action))
        return Decision(DecisionKind.DENY, None, ())
