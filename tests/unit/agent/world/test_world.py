from __future__ import annotations

import ast
import math
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.supervisor import start_obstacle
from aeros.agent.world.world import MeasurementStamp, WorldModel, world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.expr.types import BOOL
from aeros.spec.model.cause import Cause
from tests.repo.tree import PYTHON, text_of
from tests.unit.agent.dumplings import PREDICATES, STATE, outcome, skill, state, term

NOW = 100.0
AGES = st.floats(-1.0, 10.0)


class Sly(float):
    """Looks like a number and could compare as it likes."""


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, NOW) for name, value in values.items()}, NOW)


def test_known_values_are_exact() -> None:
    seen = world(fill_level=0.1, tool=(0.1, 0.0, 1.0), joint=(1.0, -3.0), area="pot", wrapper_aligned=True)
    assert seen.known == {
        "fill_level": Fraction(0.1),
        "tool": (Fraction(0.1), Fraction(0), Fraction(1)),
        "joint": (Fraction(1), Fraction(-3)),
        "area": "pot",
        "wrapper_aligned": True,
    }
    # The double 0.1 is a little more than one tenth, and that decides.
    assert seen.evaluate(term("fill_level <= 0.1")) is False
    assert seen.evaluate(term("fill_level > 0.1 and area == pot and joint[j2] == -3")) is True


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("wrapper_aligned", 1, "is of type int, which is not bool"),
        ("wrapper_aligned", "true", "is of type str"),
        ("fill_level", True, "is of type bool"),
        ("fill_level", 10**400, "outside 0 … 1"),
        ("fill_level", Sly(0.5), "is of type Sly"),
        ("fill_level", math.nan, "is not finite"),
        ("fill_level", math.inf, "is not finite"),
        ("fill_level", 1.0000001, "outside 0 … 1"),
        ("fill_level", None, "is of type NoneType"),
        ("area", "floor", "none of table, pot"),
        ("tool", (0.0, 0.0), "is of type tuple"),
        ("tool", {0.0: 0.0}, "is of type dict"),
        ("tool", (0.0, 0.0, 1.5), "outside -1 … 1"),
        ("joint", (0.0,), "is of type tuple"),
        ("joint", (0.0, math.nan), "is not finite"),
    ],
)
def test_an_unusable_value_is_unknown_with_the_reason(name: str, value: Any, why: str) -> None:
    seen = world(**{name: value})
    assert name not in seen.known
    assert why in seen.unknown[name]


@pytest.mark.parametrize(
    ("time", "known"),
    [
        (NOW, True),
        (NOW - 5.0, True),
        (math.nextafter(NOW - 5.0, 0), False),
        (math.nextafter(NOW, math.inf), False),
        (math.nan, False),
        ("noon", False),
        (True, False),
        (-math.inf, False),
    ],
)
def test_a_value_is_known_up_to_its_maximum_age_and_not_from_the_future(time: Any, *, known: bool) -> None:
    seen = world_from_readings(STATE, {"wrapper_aligned": Reading(True, time)}, NOW)
    assert ("wrapper_aligned" in seen.known) is known


def test_a_variable_without_a_maximum_age_is_unknown() -> None:
    seen = world_from_readings({"lid": state("lid", max_age=None)}, {"lid": Reading(True, NOW)}, NOW)
    assert "lid" in seen.unknown


def test_whole_numbers_and_lists_are_taken_as_what_they_denote() -> None:
    assert world(fill_level=1, tool=[0, 0.5, 1]).known == {
        "fill_level": Fraction(1),
        "tool": (Fraction(0), Fraction(1, 2), Fraction(1)),
    }


def test_undeclared_values_are_left_out() -> None:
    assert "weather" not in world(weather=True).known


@pytest.mark.parametrize(
    "condition",
    [
        "dumpling_cooked",
        "not dumpling_cooked",
        # Whatever the other operand is: unknown is a matter of the whole condition.
        "wrapper_aligned or dumpling_cooked",
        "not wrapper_aligned and dumpling_cooked",
        "dumpling_cooked == dumpling_cooked",
    ],
)
def test_a_condition_over_anything_unknown_is_unknown(condition: str) -> None:
    seen = world(wrapper_aligned=True)
    assert seen.evaluate(term(condition)) is None
    assert "`dumpling_cooked` is not measured" in seen.unmet_reason(term(condition))


@pytest.mark.parametrize(
    ("condition", "truth"),
    [
        ("wrapper_aligned or dumpling_cooked", True),
        ("not wrapper_aligned and dumpling_cooked", False),
        ("wrapper_aligned and dumpling_cooked", None),
        ("dumpling_cooked", None),
    ],
)
def test_goals_are_decided_by_the_known_values_where_these_suffice(
    condition: str, truth: bool | None
) -> None:
    assert world(wrapper_aligned=True).truth_by_known_values(term(condition)) is truth


def test_the_unmet_parts_of_a_conjunction_leave_out_true_operands() -> None:
    seen = world(wrapper_aligned=True, fill_level=0.25)
    condition = term("wrapper_aligned and fill_level > 0.5 and dumpling_cooked and dumpling_cooked")
    assert [str(part) for part in seen.unmet_parts(condition)] == [
        "fill_level is 0.25 (above 0.5)",
        "`dumpling_cooked` is not measured",
    ]


def test_a_condition_without_variables_is_known() -> None:
    assert world().evaluate(t.TRUE) is True
    assert world().evaluate(t.FALSE) is False


def test_inputs_are_known_only_where_they_are_given() -> None:
    condition = term("inputs.force > 0")
    assert world().evaluate(condition) is None
    assert world().evaluate(condition, {"inputs.force": Fraction(1)}) is True
    assert world().unmet_reason(condition) == "`inputs.force` has no value"


def test_an_action_parameter_is_never_known() -> None:
    assert world().evaluate(t.Variable("speed", BOOL, t.VariableRole.PARAMETER)) is None


def test_the_unmet_reason_shows_the_measured_values() -> None:
    assert world(fill_level=0.25).unmet_reason(term("fill_level > 0.5")) == "`fill_level` = 0.25"


def test_predicates_are_bools_and_enums_with_unknown_as_none() -> None:
    predicates = world(area="pot", wrapper_aligned=True, fill_level=0.5).predicates
    assert predicates["area"] == "pot"
    assert predicates["wrapper_aligned"] is True
    assert predicates["dumpling_cooked"] is None
    assert "fill_level" not in predicates


# Laws.

_LITERALS = st.sampled_from([f"{maybe}{name}" for maybe in ("", "not ") for name in PREDICATES])
_CONDITIONS = st.recursive(
    _LITERALS,
    lambda inner: st.builds("({} {} {})".format, inner, st.sampled_from(["and", "or", "implies"]), inner),
)
_READINGS = st.dictionaries(
    st.sampled_from(PREDICATES), st.builds(Reading, st.booleans(), st.builds(NOW.__sub__, AGES))
)


@given(_READINGS, st.floats(0.0, 10.0))
def test_later_knowledge_equals_that_of_the_same_readings_taken_then(
    readings: dict[str, Reading], passed: float
) -> None:
    seen = world_from_readings(STATE, readings, NOW)
    later, fresh = seen.at_time(NOW + passed), world_from_readings(STATE, readings, NOW + passed)
    assert later.known.items() <= seen.known.items()
    # But for a reading from the future: what was unknown stays so until it is measured again.
    assert later.known.items() <= fresh.known.items()
    still = {name for name in fresh.known if readings[name].time <= NOW}
    assert later.known.keys() == still
    assert {name: why for name, why in later.unknown.items() if name not in readings} == {
        name: why for name, why in fresh.unknown.items() if name not in readings
    }
    assert all(later.predicates[name] is None for name in PREDICATES if name not in later.known)


@given(_READINGS, st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_it_does_not_matter_in_how_many_steps_time_goes_on(
    readings: dict[str, Reading], first: float, second: float
) -> None:
    seen = world_from_readings(STATE, readings, NOW)
    end = NOW + first + second
    assert seen.at_time(NOW + first).at_time(end).known == seen.at_time(end).known


@given(_READINGS, _CONDITIONS)
def test_unknown_never_satisfies_a_precondition(readings: dict[str, Reading], condition: str) -> None:
    seen = world_from_readings(STATE, readings, NOW)
    careful = skill("careful", outcome("done", {}), precondition=condition)
    reads_unknown = any(name not in seen.known for name in t.variables_of(term(condition)))
    if reads_unknown:
        assert start_obstacle("dumpling", careful, seen, {}) is not None
        assert start_obstacle(
            "dumpling", skill("careful", outcome("done", {}), precondition=f"not {condition}"), seen, {}
        )
    assert (start_obstacle("dumpling", careful, seen, {}) is None) == (seen.evaluate(term(condition)) is True)


def test_every_known_value_has_its_stamp_source_and_age() -> None:
    camera = replace(state("lid"), sensor="camera")
    seen = world_from_readings({"lid": camera, "pot": state("pot")}, {"lid": Reading(True, NOW - 2.0)}, NOW)
    assert seen.stamps == {"lid": MeasurementStamp(NOW - 2.0, "camera", Fraction(5))}
    assert seen.age("lid") == 2.0
    assert seen.at_time(NOW + 1.0).age("lid") == 3.0
    assert seen.at_time(NOW + 4.0).stamps == {}
    assert seen.at_time(NOW + 4.0).unknown["lid"] == "was measured 6 s ago; 5 s is allowed"


@pytest.mark.parametrize("now", [math.nan, NOW - 10.0])
def test_a_clock_that_fails_leaves_nothing_known(now: float) -> None:
    assert world(wrapper_aligned=True).at_time(now).known == {}


def test_only_readings_make_a_world() -> None:
    made = [
        path.as_posix()
        for path in PYTHON
        if path.parts[:2] == ("aeros", "agent")
        for node in ast.walk(ast.parse(text_of(path)))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "WorldModel"
    ]
    # A language model's goal is judged at the declared start, too.
    assert made == ["aeros/agent/reading/formal_meaning.py"] * 2 + ["aeros/agent/world/world.py"] * 2


def test_only_what_planners_get_of_a_world_is_replaced_and_never_its_values() -> None:
    fields = {one.name for one in dataclass_fields(WorldModel)} - {
        "failures",
        "remembered",
        "things",
        "hindrances",
    }
    replaced = [
        (path.as_posix(), keyword.arg)
        for path in PYTHON
        if path.parts[:2] == ("aeros", "agent")
        for node in ast.walk(ast.parse(text_of(path)))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "replace"
        for keyword in node.keywords
        if keyword.arg in fields
    ]
    assert replaced == []


@given(_READINGS, _CONDITIONS)
def test_no_condition_reads_the_reasons_of_failed_steps(readings: dict[str, Reading], condition: str) -> None:
    seen = world_from_readings(STATE, readings, NOW)
    part = UnmetBound("wrapper_aligned", True, "exactly", False)
    explained = replace(seen, failures=(Cause("rule", "r", "wrapper_aligned", shortfalls=(part,)),))
    assert explained.evaluate(term(condition)) is seen.evaluate(term(condition))
    assert explained.unmet_reason(term(condition)) == seen.unmet_reason(term(condition))
    assert explained.at_time(NOW + 1.0).failures == ()


def test_measured_values_are_those_of_a_condition_and_of_what_a_task_reports() -> None:
    seen = world(fill_level=0.5, wrapper_aligned=True)
    values = seen.measured_values(term("wrapper_aligned"), ("fill_level", "area"))
    assert values == {"wrapper_aligned": True, "fill_level": 0.5, "area": None}
