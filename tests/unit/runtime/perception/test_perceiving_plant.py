"""A plant that measures with perceivers: between ticks, for the modules in force, and no more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.perceiving_plant import PerceivingPlant
from aeros.runtime.ports import Reading
from aeros.sim.fake import FakePlant
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.perception import Definition
from aeros.spec.model.task_parameters import TaskParameter, instruction_of
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import SPAN, build
from tests.unit.runtime.perception.kettle import (
    CRASH,
    PLACE,
    CameraPlant,
    Scripted,
    configuration,
    kettle,
    site,
)

HOT = {"water_hot": True}


def silent(now: float, values: Mapping[str, Any]) -> None:
    return None


class Changing(FixedGovernor):
    """A governor whose configuration a test changes."""

    number = 0
    failing: UserError | None = None

    @property
    def generation(self) -> int:
        return self.number

    def configuration(self) -> tuple[int, Configuration]:
        if self.failing is not None:
            raise self.failing
        return self.number, super().configuration()[1]

    def change(self, configuration: Configuration) -> None:
        self._configuration = configuration
        self.number += 1


class Setting:
    """A plant with a camera, wrapped, and what is around it."""

    def __init__(
        self, *answers: Mapping[str, Any] | Exception, ecm: Ecm | None = None, plant: Any = None
    ) -> None:
        self.inner = CameraPlant() if plant is None else plant
        self.runs = Scripted(*answers or (HOT,))
        self.governor = Changing(configuration(ecm or kettle()))
        self.events: list[str] = []
        self.plant = PerceivingPlant(
            self.inner, self.governor, self.runs, lambda event, details: self.events.append(event)
        )


def declared(**changes: Any) -> Ecm:
    ecm = kettle()
    return replace(ecm, perceivers={"kettle_view": replace(ecm.perceivers["kettle_view"], **changes)})


def test_perceived_values_are_observed_with_the_readings_of_the_plant() -> None:
    setting = Setting()
    assert set(setting.plant.observe()) == {"tool_position"}
    setting.inner.time = 3.0
    setting.inner.take(2.5)
    assert setting.plant.observe() == {
        "tool_position": Reading(PLACE, 3.0),
        "kettle.water_hot": Reading(True, 2.5),
    }
    assert setting.plant.pictures() == setting.inner.taken


def test_perceivers_see_the_readings_of_the_plant() -> None:
    setting = Setting()
    setting.inner.take()
    setting.plant.observe()
    assert setting.runs.views[0].readings == {"tool_position": PLACE}


def test_no_perceiver_runs_inside_a_tick() -> None:
    setting = Setting()
    setting.plant.observe()
    seen: list[Any] = []

    def monitor(now: float, values: Mapping[str, Any]) -> None:
        setting.inner.take()
        seen.append(setting.plant.observe())

    setting.plant.advance(monitor, 1.0)
    assert seen == [{"tool_position": Reading(PLACE, 0.0)}]
    assert setting.runs.views == []
    assert "kettle.water_hot" in setting.plant.observe()


def test_a_monitor_that_fails_leaves_the_plant_able_to_perceive() -> None:
    setting = Setting()

    def monitor(now: float, values: Mapping[str, Any]) -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError):
        setting.plant.advance(monitor, 1.0)
    setting.inner.take()
    assert "kettle.water_hot" in setting.plant.observe()


def test_on_a_plant_in_real_time_perceivers_wait_until_nothing_is_under_way() -> None:
    class Robot(CameraPlant):
        runs_in_real_time = True

    setting = Setting(plant=Robot())
    assert setting.plant.runs_in_real_time
    setting.plant.begin(act("wait", duration=1.0))
    setting.inner.take()
    assert "kettle.water_hot" not in setting.plant.observe()
    setting.plant.advance(silent, 1.0)
    assert "kettle.water_hot" in setting.plant.observe()
    assert setting.runs.limits == [0.2]
    setting.plant.begin(act("wait", duration=1.0))
    setting.inner.take()
    setting.plant.stop()
    assert setting.plant.observe()["kettle.water_hot"].time == setting.plant.now()


def test_a_simulator_gives_a_perceiver_five_seconds_at_least_and_may_be_amid_a_motion() -> None:
    setting = Setting()
    setting.plant.begin(act("wait", duration=1.0))
    setting.inner.take()
    assert "kettle.water_hot" in setting.plant.observe()
    assert setting.runs.limits == [5.0]


def test_the_monitor_sees_nothing_that_was_perceived_unless_the_site_lets_invariants_read_it() -> None:
    for in_invariants in (frozenset[str](), frozenset({"kettle.water_hot"})):
        setting = Setting()
        fixed = configuration(kettle())
        perception = replace(fixed.site.perception, in_invariants=in_invariants)
        setting.governor.change(replace(fixed, site=replace(fixed.site, perception=perception)))
        setting.inner.take()
        setting.plant.observe()
        seen: list[Mapping[str, Any]] = []
        setting.plant.advance(lambda now, values: seen.append(dict(values)), 1.0)  # noqa: B023
        shown = {name: Reading(True, 0.0) for name in in_invariants}
        assert seen == [{"tool_position": PLACE, **shown}]


def test_readings_are_sampled_at_ticks_and_stops_are_announced_to_the_monitor() -> None:
    class Stopping(CameraPlant):
        def advance(self, monitor: Any, until: float) -> Any:
            monitor.begin_stop("blocked", 0.5)
            return super().advance(monitor, until)

    class Monitor:
        stops: list[tuple[str, float]] = []  # noqa: RUF012

        def __call__(self, now: float, values: Mapping[str, Any]) -> str | None:
            return None

        def begin_stop(self, reason: str, now: float) -> None:
            self.stops.append((reason, now))

    setting = Setting(ecm=declared(rate=Fraction(10)), plant=Stopping())
    setting.plant.observe()
    monitor = Monitor()
    setting.plant.advance(monitor, 1.0)
    setting.inner.take()
    setting.plant.observe()
    assert setting.runs.views[0].samples == {"tool_position": ((0.0, PLACE),)}
    assert monitor.stops == [("blocked", 0.5)]


def test_the_rule_of_the_monitor_is_passed_on() -> None:
    setting = Setting(ecm=declared(rate=Fraction(10)))
    setting.plant.observe()
    motion = setting.plant.begin(act("wait", duration=1.0))
    ended = setting.plant.advance(lambda now, values: "rule", 1.0)
    assert ended[motion].reason == "monitor:rule"  # type: ignore[index]


def test_a_plant_that_measures_the_variables_itself_is_believed() -> None:
    plant = CameraPlant()
    plant.values["kettle.water_hot"] = False
    plant.take()
    setting = Setting(plant=plant)
    assert setting.plant.observe()["kettle.water_hot"] == Reading(False, 0.0)
    assert setting.runs.views == []


def test_perceivers_follow_the_configuration() -> None:
    setting = Setting()
    setting.inner.take()
    setting.plant.observe()
    # Another configuration with the same module and site: the run goes on.
    setting.governor.change(configuration(kettle()))
    assert "kettle.water_hot" in setting.plant.observe()
    assert (setting.runs.opened, setting.runs.closed) == (1, 0)
    # Another version of the module: a new run.
    setting.governor.change(configuration(replace(kettle(), code_digest="d" * 64)))
    setting.inner.take()
    assert "kettle.water_hot" in setting.plant.observe()
    assert (setting.runs.opened, setting.runs.closed) == (2, 1)
    # No module: no values.
    setting.governor.change(replace(configuration(kettle()), modules={}))
    assert set(setting.plant.observe()) == {"tool_position"}
    assert setting.runs.closed == 2


def test_without_a_proved_configuration_nothing_is_perceived() -> None:
    setting = Setting()
    setting.inner.take()
    setting.governor.failing = UserError([Diagnostic("AE002", "not proved")])
    assert set(setting.plant.observe()) == {"tool_position"}
    setting.governor.failing = None
    assert "kettle.water_hot" in setting.plant.observe()


def test_a_failing_perceiver_leaves_the_readings_of_the_plant() -> None:
    setting = Setting(CRASH)
    setting.inner.take()
    assert set(setting.plant.observe()) == {"tool_position"}
    assert setting.events == ["perceiver-failed"]


def test_every_other_call_is_passed_on() -> None:
    setting = Setting()
    motion = setting.plant.begin(act("grip"), setting.plant.plan(act("grip")))
    setting.plant.halt(motion)  # type: ignore[arg-type]
    setting.plant.skill_began("kettle.fill")
    setting.plant.skill_ended("kettle.fill", finished=True)
    setting.plant.stop()
    assert [call[0] for call in setting.inner.calls] == [
        "plan", "begin", "halt", "skill_began", "skill_ended", "stop"
    ]  # fmt: skip
    assert setting.plant.now() == setting.inner.now()


def test_the_perceivers_end_with_the_plant() -> None:
    setting = Setting()
    setting.inner.take()
    setting.plant.observe()
    setting.plant.close()
    assert setting.inner.closed
    assert setting.runs.closed == 1


def test_a_plant_without_cameras_has_no_pictures() -> None:
    setting = Setting(plant=FakePlant({"tool_position": PLACE}))
    assert setting.plant.pictures() == {}
    assert set(setting.plant.observe()) == {"tool_position"}


def defining(text: str) -> Ecm:
    """The module with a predicate `kettle.near` that is defined by a condition, and no perceiver."""
    ecm, name = kettle(), "kettle.near"
    variable = t.Variable(name, BOOL, t.VariableRole.STATE)
    near = Declared(variable, ecm.span, max_age=Fraction(60), sensor=name)
    term = check(parse(text), state_scope(site()), BOOL)
    return replace(
        ecm, perceivers={}, state={name: near}, definitions={name: Definition(term, text, ecm.span)}
    )


def test_definitions_are_evaluated_at_each_observation_and_follow_the_configuration() -> None:
    plant = CameraPlant()
    setting = Setting(ecm=defining("tool_position.x < 0.6 m"), plant=plant)
    assert setting.plant.observe()["kettle.near"] == Reading(True, 0.0)
    plant.values["tool_position"] = (0.7, 0.0, 0.3)
    assert setting.plant.observe()["kettle.near"] == Reading(False, 0.0)
    setting.governor.change(configuration(defining("tool_position.x > 0.6 m")))
    assert setting.plant.observe()["kettle.near"] == Reading(True, 0.0)
    setting.governor.change(configuration(replace(defining("true"), definitions={})))
    assert "kettle.near" not in setting.plant.observe()


def test_a_plant_that_measures_a_defined_predicate_itself_is_believed() -> None:
    plant = CameraPlant(**{"kettle.near": False})
    setting = Setting(ecm=defining("tool_position.x < 0.6 m"), plant=plant)
    assert setting.plant.observe()["kettle.near"].value is False


def test_a_definition_may_read_another_whichever_comes_first() -> None:
    ecm = defining("tool_position.x < 0.6 m")
    near = ecm.state["kettle.near"]
    far = replace(near, variable=t.Variable("kettle.far", BOOL, t.VariableRole.STATE), sensor="kettle.far")
    negated = Definition(t.Not(near.variable), "not near", ecm.span)
    both = replace(
        ecm,
        state={**ecm.state, "kettle.far": far},
        definitions={"kettle.far": negated, **ecm.definitions},
    )
    observed = Setting(ecm=both).plant.observe()
    assert (observed["kettle.near"].value, observed["kettle.far"].value) == (True, False)
    circle = {"kettle.far": negated, "kettle.near": Definition(t.Not(far.variable), "not far", ecm.span)}
    assert (
        not {"kettle.near", "kettle.far"}
        & Setting(ecm=replace(both, definitions=circle)).plant.observe().keys()
    )


def test_a_tick_evaluates_definitions_and_follows_no_new_configuration() -> None:
    setting = Setting(ecm=defining("tool_position.x < 0.6 m"))
    setting.plant.observe()
    seen: list[Reading] = []

    def look(now: float, values: Mapping[str, Any]) -> None:
        setting.governor.failing = UserError([Diagnostic("AE965", "asked at a tick")])
        setting.governor.number += 1
        seen.append(setting.plant.observe()["kettle.near"])

    setting.plant.begin(act("wait", duration=0.1))
    setting.plant.advance(look, 0.05)
    assert seen
    assert all(one.value is True for one in seen)
    setting.governor.failing = None
    setting.governor.change(configuration(defining("tool_position.x > 0.6 m")))
    assert setting.plant.observe()["kettle.near"].value is False


def test_a_module_that_nobody_attends_to_measures_nothing() -> None:
    setting = Setting()
    setting.inner.take()
    assert "kettle.water_hot" in setting.plant.observe()
    setting.plant.attend(frozenset({"other"}))
    assert "kettle.water_hot" not in setting.plant.observe()
    assert setting.runs.closed == 1
    setting.inner.take()
    setting.plant.observe()
    assert len(setting.runs.views) == 1
    setting.plant.attend(frozenset({"kettle"}))
    assert "kettle.water_hot" in setting.plant.observe()
    setting.plant.attend(None)
    assert "kettle.water_hot" in setting.plant.observe()
    assert setting.runs.closed == 1
    assert len(setting.runs.views) == 2


def test_a_definition_of_a_module_that_nobody_attends_to_is_unknown() -> None:
    setting = Setting(ecm=defining("true"))
    assert "kettle.near" in setting.plant.observe()
    setting.plant.attend(frozenset())
    assert "kettle.near" not in setting.plant.observe()


SIDE = "kettle.side"


def asked() -> Ecm:
    """The kettle, with a task that says a side, which its perceiver reads."""
    ecm = kettle()
    type_ = EnumType(SIDE, ("left", "right"))
    declared = Declared(t.Variable(SIDE, type_, t.VariableRole.STATE), SPAN, max_age=Fraction(1))
    declared = replace(declared, sensor=instruction_of("kettle"))
    task = build(Task, id="watch", parameters={"side": TaskParameter("side", declared, "left")})
    view = ecm.perceivers["kettle_view"]
    perceiver = replace(view, read_as={**view.read_as, "side": SIDE})
    return replace(
        ecm, tasks={"watch": task}, state={**ecm.state, SIDE: declared}, perceivers={"kettle_view": perceiver}
    )


def test_a_parameter_is_a_reading_of_now_with_its_default_or_what_the_instruction_says() -> None:
    setting = Setting(ecm=asked())
    assert setting.plant.observe()[SIDE] == Reading("left", 0.0)
    setting.plant.set_parameters({SIDE: "right"})
    setting.inner.time = 2.0
    setting.inner.take()
    assert setting.plant.observe()[SIDE] == Reading("right", 2.0)
    assert setting.runs.views[-1].readings["side"] == "right"
    setting.plant.set_parameters({})
    assert setting.plant.observe()[SIDE] == Reading("left", 2.0)


@pytest.mark.parametrize(
    ("value", "time", "stands"),
    [("left", 4.0, True), ("right", 4.0, False), ("left", 3.0, False), (1, 4.0, False)],
)
def test_readings_of_a_plant_that_measures_all_itself_stay_one_object(
    value: object, time: float, stands: bool
) -> None:
    measured = {"kettle.water_hot": Reading(True, 4.0), SIDE: Reading(value, time)}

    class Complete(CameraPlant):
        def observe(self) -> Mapping[str, Reading]:
            return measured

    setting = Setting(ecm=asked(), plant=Complete())
    setting.inner.time = 4.0
    observed = setting.plant.observe()
    assert (observed is measured) is stands
    assert observed == {**measured, SIDE: Reading("left", 4.0)}


def test_values_that_depend_on_a_changed_parameter_are_measured_anew() -> None:
    setting = Setting(HOT, CRASH, HOT, ecm=asked())
    setting.inner.take()
    setting.plant.observe()
    opened = setting.runs.opened
    setting.plant.set_parameters({SIDE: "left"})
    assert "kettle.water_hot" in setting.plant.observe()
    assert setting.runs.opened == opened
    setting.plant.set_parameters({SIDE: "right"})
    # The perceiver begins anew, and this time it fails: what it said of the other side is gone.
    assert "kettle.water_hot" not in setting.plant.observe()
    assert setting.runs.opened == opened + 1


def test_a_plant_that_has_use_for_the_parameters_gets_them() -> None:
    class Asked(CameraPlant):
        stated: Mapping[str, Any] = {}

        def set_parameters(self, values: Mapping[str, Any]) -> None:
            self.stated = values

    plant = Asked()
    Setting(ecm=asked(), plant=plant).plant.set_parameters({SIDE: "right"})
    assert plant.stated == {SIDE: "right"}
