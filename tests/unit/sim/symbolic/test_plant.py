from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import dist
from typing import Any

import pytest

from aeros.runtime.ports import MotionCompletion, MotionHandle, Plant
from aeros.sim.gilbert_elliott import GilbertElliottModel
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.symbolic.outcomes import BurstOutcomes, draw_outcome
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import Action, act
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.ecm import Ecm, Outcome, Skill, Task
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.policy import Access, ModuleLimits
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import TaskParameter
from aeros.spec.model.variables import Declared
from tests.modules.robot import configuration_of
from tests.unit.agent.dumplings import build
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.robot.panda import PANDA

SPAN = Source("site.yaml", "text").span(0, 4)
BENT = (0.5, -0.3, 0.0, -1.9, 0.0, 1.6, 0.8)
JOINTS = EnumType("joints", ("j1", "j2", "j3", "j4", "j5", "j6", "j7"))
KINDS = ("move_tool", "move_joints", "slide", "move_base", "grip", "wait", "look", "stop", "whistle")


def state(name: str, type_: Type, low: str = "-10", high: str = "10") -> tuple[str, Declared]:
    bounds = (Fraction(low), Fraction(high))
    variable = t.Variable(name, type_, t.VariableRole.STATE)
    return name, Declared(variable, SPAN, range=bounds, max_age=Fraction(1, 10), sensor="sensor")


STATE = dict(
    [
        state("tool_position", VectorType(LENGTH)),
        state("tool_speed", RealType(LENGTH), "0", "2"),
        state("base_position", VectorType(LENGTH)),
        state("cup_position", VectorType(LENGTH)),
        state("finger_gap", RealType(LENGTH), "0", "0.07"),
        state("human_distance", RealType(LENGTH), "0", "8.1"),
        state("joint_position", FamilyType(JOINTS, RealType(NUMBER))),
        state("temperature", RealType(NUMBER), "280.1", "400"),
        state("cells", FamilyType(EnumType("cells", ("a", "b")), BOOL)),
        state("mode", EnumType("modes", ("idle", "busy"))),
        state("holding", BOOL),
        state("cooked", BOOL),
    ]
)


def parameter(name: str, type_: Type) -> Declared:
    return Declared(
        t.Variable(name, type_, t.VariableRole.PARAMETER), SPAN, range=(Fraction(-10), Fraction(10))
    )


PARAMETERS: Mapping[str, Mapping[str, Type]] = {
    "move_tool": {"target": VectorType(LENGTH), "yaw": RealType(NUMBER), "speed": RealType(NUMBER)},
    "move_joints": {name: RealType(NUMBER) for name in ("q1", "q2", "q3", "q4", "q5", "q6", "q7", "speed")},
    "slide": {"target": VectorType(LENGTH), "force": RealType(NUMBER), "speed": RealType(NUMBER)},
    "move_base": {"x": RealType(LENGTH), "y": RealType(LENGTH), "speed": RealType(NUMBER)},
    "grip": {"width": RealType(LENGTH), "force": RealType(NUMBER)},
    "wait": {"duration": RealType(NUMBER)},
    "look": {"camera": EnumType("cameras", ("mast", "hand"))},
    "whistle": {"loud": BOOL},
}


def kind(name: str) -> ActionKind:
    parameters = {one: parameter(one, type_) for one, type_ in PARAMETERS.get(name, {}).items()}
    return ActionKind(name, frozenset(), Risk.LOW, name == "stop", parameters, SPAN)


def site() -> Site:
    kinds = {name: kind(name) for name in KINDS}
    limits = ModuleLimits(Fraction(100), 3, 3)
    return Site(
        "kitchen", "", {}, {}, {}, STATE, kinds, (), Access(), {}, Risk.HIGH, limits, (), (), {}, SPAN
    )


def module(*outcomes: Outcome) -> Mapping[str, Ecm]:
    skill = Skill(
        id="lift",
        module_name="skills",
        function="lift",
        inputs={},
        precondition=None,
        outcomes={outcome.id: outcome for outcome in outcomes},
        envelope={},
        actuators=frozenset(),
        resources=frozenset(),
        risk=Risk.LOW,
        timeout=Fraction(10),
        runtime_checked={},
        span=SPAN,
        entry_span=SPAN,
        risk_span=SPAN,
    )
    ecm = Ecm(
        id="handling",
        version="1.0.0",
        folder="",
        manifest_digest="",
        code_digest="",
        capabilities={},
        skills={"lift": skill},
        tasks={},
        requested_access=Access(),
        permitted_actions={},
        required_modules={},
        requires_spans={},
        required_aeros_version=">=0.1",
        runtime_span=SPAN,
        access_span=SPAN,
        span=SPAN,
    )
    return {"handling": ecm}


def outcome(id_: str, probability: str | None = None, duration: str | None = None, **effects: Any) -> Outcome:
    share = None if probability is None else Fraction(probability)
    return Outcome(id_, effects, id_ != "lifted", share, None if duration is None else Fraction(duration))


def values(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def watch(now: float, measured: Mapping[str, Any]) -> str | None:
    return None


def run_skill(plant: Plant) -> None:
    plant.skill_began("handling.lift")
    plant.skill_ended("handling.lift", finished=True)


LIFTED, SLIPPED = outcome("lifted", "0.7", holding=True), outcome("slipped", holding=False)


def test_it_begins_harmless_and_inside_every_range() -> None:
    first = values(SymbolicPlant(site(), {}, 0, {"base_position": (1.0, 0.0, 0.0)}))
    assert 8.0 < Fraction(first["human_distance"]) <= Fraction("8.1")
    assert Fraction(first["finger_gap"]) <= Fraction("0.07")
    assert Fraction(first["temperature"]) >= Fraction("280.1")
    assert first["joint_position"][3] == pytest.approx(-2.356, abs=1e-3)
    assert first["tool_position"] == (0.307, 0.0, 0.487)
    assert first["base_position"] == (1.0, 0.0, 0.0)
    assert first["cup_position"] == (0.45, 0.0, 0.15)
    assert (first["holding"], first["cells"], first["mode"]) == (False, (False, False), "idle")
    assert first.keys() == STATE.keys()


@pytest.mark.parametrize(
    ("action", "changed", "seconds"),
    [
        (
            act("move_tool", target=(0.307, 0.5, 0.487), yaw=0.0, speed=0.25),
            {"tool_position": (0.307, 0.5, 0.487)},
            3.75 + 1 / 240,
        ),
        (
            act("move_joints", q1=0.5, q2=-0.3, q3=0.0, q4=-1.9, q5=0.0, q6=1.6, q7=0.8, speed=0.5),
            {"tool_position": tool_kinematics(PANDA, BENT).position},
            1.875 * dist(tool_kinematics(PANDA, BENT).position, (0.307, 0.0, 0.487)) / 0.5 + 1 / 240,
        ),
        (act("slide", target=(0.307, 0.0, 0.487), force=5.0, speed=0.1), {}, 1 / 240),
        (
            act("move_base", x=3.0, y=4.0, speed=1.0),
            {"base_position": (3.0, 4.0, 0.0), "tool_position": (3.307, 4.0, 0.487)},
            1.875 * 5 + 1 / 240,
        ),
        (act("grip", width=0.02, force=10.0), {"finger_gap": 0.02}, 0.5),
        (act("wait", duration=2.5), {}, 2.5),
        (act("wait", duration=0.0), {}, 1 / 240),
        (act("look", camera="mast"), {}, 0.1),
        (act("stop"), {}, 1 / 240),
        (act("whistle", loud=True), {}, 1 / 240),
    ],
)
def test_a_motion_takes_effect_and_its_time(action: Action, changed: dict[str, Any], seconds: float) -> None:
    plant: Plant = SymbolicPlant(site(), {}, 0)
    before = values(plant)
    assert execute(plant, action, watch, 100.0) == MotionCompletion(True)
    assert values(plant) == {**before, **changed}
    assert plant.now() == pytest.approx(seconds)
    assert {reading.time for reading in plant.observe().values()} == {plant.now()}


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (act("fly"), "unknown kind: `fly`"),
        (
            act("move_tool", target=(0.3, 0.5), yaw=0.0, speed=0.25),
            "bad parameter: `target` is not a 3-tuple",
        ),
        (
            act("move_tool", target=(0.3, 0.5, "z"), yaw=0.0, speed=0.25),
            "bad parameter: `target` is not a finite number",
        ),
        (act("move_tool", target=(0.3, 0.5, 0.1), yaw=0.0), "missing parameter: `speed`"),
        (act("wait", duration=1.0, haste=True), "unknown parameter: `haste`"),
        (act("look", camera="roof"), "bad parameter: `camera` is none of mast, hand"),
        (act("whistle", loud=1), "bad parameter: `loud` is not true or false"),
        (act("wait", duration=10**400), "bad parameter: `duration` is not a finite number"),
        (
            act("move_tool", target=(0.3, 0.5, 0.1), yaw=0.0, speed=0.0),
            "out of range: `speed` = 0 is below 0.001",
        ),
        (act("wait", duration=float("inf")), "bad parameter: `duration` is not a finite number"),
        (act("grip", width=True, force=1.0), "bad parameter: `width` is not a finite number"),
    ],
)
def test_impossible_actions_are_refused_before_any_motion(action: Action, reason: str) -> None:
    plant = SymbolicPlant(site(), {}, 0)
    before = plant.observe()
    assert execute(plant, action, watch, 100.0) == MotionCompletion(False, reason)
    assert plant.observe() == before


def test_the_monitor_sees_the_motion_under_way_and_at_its_end() -> None:
    seen: list[Mapping[str, Any]] = []

    def monitor(now: float, measured: Mapping[str, Any]) -> str | None:
        seen.append(dict(measured))
        return None

    plant = SymbolicPlant(site(), {}, 0)
    execute(plant, act("move_tool", target=(0.3, 0.5, 0.4), yaw=0.0, speed=0.25), monitor, 100.0)
    assert [(one["tool_speed"], one["tool_position"]) for one in seen] == [
        (0.25, (0.307, 0.0, 0.487)),
        (0.0, (0.3, 0.5, 0.4)),
    ]


def test_the_monitor_sees_what_rules_may_read_and_no_other_variable_of_a_module() -> None:
    around = configuration_of("clean_table")
    plant = SymbolicPlant(around.site, around.modules, 0)
    seen: set[str] = set()

    def monitor(now: float, measured: Mapping[str, Any]) -> str | None:
        seen.update(measured)
        return None

    execute(plant, act("wait", duration=1.0), monitor, 100.0)
    assert seen == plant.observe().keys() & around.site.rule_variables.keys()
    assert plant.observe().keys() - seen > {"clean_table.table_wiped"}


def test_the_monitor_stops_a_motion_before_its_effect() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    before = plant.observe()
    stopped = execute(plant, act("grip", width=0.02, force=1.0), lambda now, values: "rule", 100.0)
    assert stopped == MotionCompletion(False, "monitor:rule")
    assert plant.observe() == before


def test_a_motion_stops_at_its_deadline() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    assert execute(plant, act("wait", duration=5.0), watch, 2.0) == MotionCompletion(False, "deadline")
    assert plant.now() == 2.0


def test_outcomes_come_as_often_as_declared() -> None:
    plant = SymbolicPlant(site(), module(LIFTED, SLIPPED), seed=7)
    lifted = 0
    for _ in range(4000):
        run_skill(plant)
        lifted += values(plant)["holding"]
    # Five standard deviations.
    assert abs(lifted - 2800) < 5 * (4000 * 0.7 * 0.3) ** 0.5


def test_outcomes_in_bursts_come_as_often_as_declared_and_together() -> None:
    channel = GilbertElliottModel(Fraction(3, 10), Fraction(10))
    bursts = BurstOutcomes(channel.process(), [(LIFTED, Fraction(1))], [(SLIPPED, Fraction(1))])
    rested = SymbolicPlant(site(), module(LIFTED, SLIPPED), 0, None, {"handling.lift": bursts})
    slipped = 0
    followed: list[bool] = []
    for seed in range(400):
        plant, before = rested.reset(seed), False
        for _ in range(20):
            run_skill(plant)
            now = not values(plant)["holding"]
            slipped += now
            followed += [now] if before else []
            before = now
    # A burst goes on with 9 in 10, and the mean of a chain like this spreads about 5 times as wide.
    assert slipped / 8000 == pytest.approx(0.3, abs=0.06)
    assert sum(followed) / len(followed) == pytest.approx(0.9, abs=0.02)


def test_outcomes_depend_on_seed_and_invocation_and_nothing_else() -> None:
    shares = outcome_probabilities([LIFTED, SLIPPED])
    backwards = [draw_outcome(shares, 7, "handling.lift", run) for run in reversed(range(50))]
    plant = SymbolicPlant(site(), module(LIFTED, SLIPPED), seed=7)
    drawn = []
    for _ in range(50):
        execute(plant, act("wait", duration=0.1), watch, 100.0)
        run_skill(plant)
        drawn.append(values(plant)["holding"])
    assert drawn == [one.id == "lifted" for one in reversed(backwards)]
    others = [draw_outcome(shares, 8, "handling.lift", run) for run in range(50)]
    assert [one.id == "lifted" for one in others] != drawn


def test_a_reset_plant_is_in_its_initial_state() -> None:
    used = SymbolicPlant(site(), module(LIFTED, SLIPPED), 7, {"base_position": (1.0, 0.0, 0.0)})
    execute(used, act("move_base", x=2.0, y=1.0, speed=0.5), watch, 100.0)
    for _ in range(5):
        run_skill(used)
    made = SymbolicPlant(site(), module(LIFTED, SLIPPED), 8, {"base_position": (1.0, 0.0, 0.0)})
    anew = used.reset(8)
    assert (anew.now(), anew.observe()) == (0.0, made.observe())
    for _ in range(20):
        run_skill(made)
        run_skill(anew)
        assert anew.observe() == made.observe()


def test_a_plant_lists_the_outcomes_it_has_drawn() -> None:
    plant = SymbolicPlant(site(), module(LIFTED, SLIPPED), seed=7)
    assert plant.drawn_outcomes() == ()
    expected = []
    for run in range(20):
        run_skill(plant)
        expected.append(("handling.lift", run, "lifted" if values(plant)["holding"] else "slipped"))
    assert plant.drawn_outcomes() == tuple(expected)
    assert {outcome for *_, outcome in expected} == {"lifted", "slipped"}
    # A skill that was halted has none of its outcomes.
    plant.skill_began("handling.lift")
    plant.skill_ended("handling.lift", finished=False)
    assert plant.drawn_outcomes() == tuple(expected)
    assert plant.reset(7).drawn_outcomes() == ()


def test_the_end_of_a_motion_accounts_for_changes_by_another_motion() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    drive = act("move_base", x=1.0, y=0.0, speed=1.0)
    slow = act("move_base", x=3.0, y=0.0, speed=1.0)
    for action in (drive, slow):
        assert not isinstance(plant.begin(action, plant.plan(action)), MotionCompletion)
    tool = values(plant)["tool_position"]
    for x in (1.0, 3.0):
        plant.advance(watch, 100.0)
        assert values(plant)["base_position"][0] == x
        assert values(plant)["tool_position"][0] == pytest.approx(tool[0] + x)


def test_a_skill_that_did_not_finish_has_no_outcome_and_uses_up_no_draw() -> None:
    plant = SymbolicPlant(site(), module(outcome("lifted", holding=True)), seed=0)
    plant.skill_began("handling.lift")
    plant.skill_ended("handling.lift", finished=False)
    assert values(plant)["holding"] is False
    run_skill(plant)
    assert values(plant)["holding"] is True


def test_an_outcome_takes_its_declared_duration_at_least() -> None:
    plant = SymbolicPlant(site(), module(outcome("lifted", duration="12")), seed=0)
    execute(plant, act("wait", duration=1.0), watch, 100.0)
    plant.skill_began("handling.lift")
    execute(plant, act("wait", duration=5.0), watch, 100.0)
    plant.skill_ended("handling.lift", finished=True)
    assert plant.now() == 13.0


def test_exact_effects_are_measured_as_doubles_inside_their_range() -> None:
    tool = (Fraction(1, 10), Fraction(0), Fraction(1, 3))
    warm = outcome("lifted", temperature=Fraction("280.1"), tool_position=tool, mode="busy")
    plant = SymbolicPlant(site(), module(warm), seed=0)
    run_skill(plant)
    after = values(plant)
    assert after["tool_position"] == (0.1, 0.0, 1 / 3)
    assert Fraction("280.1") <= Fraction(after["temperature"]) < Fraction("280.1000001")
    assert after["mode"] == "busy"


def test_outcomes_without_a_probability_share_the_rest() -> None:
    some = [outcome("lifted", "0.5"), outcome("a"), outcome("b")]
    assert [share for _, share in outcome_probabilities(some)] == [
        Fraction(1, 2),
        Fraction(1, 4),
        Fraction(1, 4),
    ]
    shares = outcome_probabilities([outcome("lifted", "1"), outcome("never")])
    assert Counter(draw_outcome(shares, 0, "s", run).id for run in range(100)) == {"lifted": 100}


@pytest.mark.parametrize("shares", [["0.5"], ["0.7", "0.7"], ["0.7", "0.7", None], ["-1", "2"], []])
def test_probabilities_that_are_not_a_distribution_raise_misuse(shares: list[str | None]) -> None:
    with pytest.raises(MisuseError, match="not a distribution"):
        SymbolicPlant(site(), module(*(outcome(str(n), share) for n, share in enumerate(shares))), seed=0)


def test_unknown_names_are_misuse() -> None:
    with pytest.raises(MisuseError, match="`weather`"):
        SymbolicPlant(site(), {}, 0, {"weather": 1.0})
    with pytest.raises(MisuseError, match="`weather`"):
        SymbolicPlant(site(), module(outcome("lifted", weather=True)), 0)
    with pytest.raises(MisuseError, match=r"handling\.absent"):
        SymbolicPlant(site(), {}, 0).skill_began("handling.absent")


def test_it_needs_no_simulator() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    plant.stop()
    plant.close()
    plant.close()
    assert plant.now() == 0.0


def _started(plant: SymbolicPlant, action: Action) -> MotionHandle:
    motion = plant.begin(action)
    assert not isinstance(motion, MotionCompletion)
    return motion


def test_parallel_motions_end_in_the_order_of_their_end_times() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    seen: list[float] = []

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        seen.append(values["tool_speed"])
        return None

    move = _started(plant, act("move_tool", target=(0.3, 0.5, 0.4), yaw=0.0, speed=0.25))
    wait = _started(plant, act("wait", duration=0.1))
    assert plant.advance(monitor, 0.05) == {}
    assert plant.now() == 0.05
    assert plant.advance(monitor, 100.0) == {wait: MotionCompletion(True)}
    assert plant.now() == 0.1
    assert seen == [0.25] * 4  # the move goes on at the end of the wait
    assert plant.advance(monitor, 100.0) == {move: MotionCompletion(True)}
    assert seen[-1] == 0.0


def test_a_tool_that_the_base_carries_is_at_its_target_once_the_base_has_come_to_rest() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    drive = plant.begin(act("move_base", x=3.0, y=4.0, speed=1.0))
    move = plant.begin(act("move_tool", target=(3.5, 4.0, 0.3), yaw=0.0, speed=5.0))
    grip = plant.begin(act("grip", width=0.02, force=10.0))
    ended = [plant.advance(watch, 100.0) for _ in range(3)]
    assert ended == [
        {grip: MotionCompletion(True)},
        {drive: MotionCompletion(True)},
        {move: MotionCompletion(True)},
    ]
    assert values(plant)["tool_position"] == (3.5, 4.0, 0.3)
    assert values(plant)["base_position"] == (3.0, 4.0, 0.0)
    assert plant.now() == pytest.approx(1.875 * 5 + 1 / 240)


def test_a_halted_motion_ends_without_effect_and_the_other_goes_on() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    before = plant.observe()["tool_position"].value
    move = _started(plant, act("move_tool", target=(0.3, 0.5, 0.4), yaw=0.0, speed=0.25))
    wait = _started(plant, act("wait", duration=9.0))
    plant.halt(move)
    assert plant.advance(watch, 100.0) == {move: MotionCompletion(False, "halted")}
    assert plant.observe()["tool_position"].value == before
    assert plant.advance(watch, 100.0) == {wait: MotionCompletion(True)}


def test_a_rule_that_breaks_ends_everything_under_way() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    motions = [_started(plant, act("wait", duration=seconds)) for seconds in (1.0, 2.0)]
    broken = MotionCompletion(False, "monitor:rule")
    assert plant.advance(lambda now, values: "rule", 100.0) == dict.fromkeys(motions, broken)


def test_time_passes_while_no_motion_is_under_way() -> None:
    plant = SymbolicPlant(site(), {}, 0)
    assert plant.advance(watch, 2.5) == {}
    assert plant.now() == 2.5


def test_a_modules_own_variables_are_measured_and_those_of_absent_modules_are_not() -> None:
    name, lifts = state("handling.lifted", BOOL)
    level, tall = state("handling.level", RealType(LENGTH))
    cell = replace(site(), state={**site().state, name: lifts, level: tall})
    assert not {name, level} & SymbolicPlant(cell, {}, 0).observe().keys()
    lifted = replace(LIFTED, effects={name: True, level: Fraction(1, 4)}, probability=Fraction(1))
    plant = SymbolicPlant(cell, module(lifted), 0)
    assert (values(plant)[name], values(plant)[level]) == (False, 0.0)
    run_skill(plant)
    assert (values(plant)[name], values(plant)[level]) == (True, 0.25)
    elsewhere = {"pot": module(lifted)["handling"]}
    with pytest.raises(MisuseError, match="which is not a state variable"):
        SymbolicPlant(cell, elsewhere, 0)


def test_a_position_of_a_module_that_nobody_gives_is_unknown_and_never_made_up() -> None:
    around = configuration_of("clean_table")
    start = {"clean_table.robot_at_table": True, "clean_table.bin_position": (0.4, -1.7, 0.1)}
    plant = SymbolicPlant(around.site, around.modules, 0, start)
    seen = plant.observe()
    assert "clean_table.dock_position" not in seen
    assert seen["clean_table.bin_position"].value == (0.4, -1.7, 0.1)
    assert seen["clean_table.robot_at_table"].value is True  # nothing known speaks against it
    assert {"tool_position", "base_position"} <= set(seen)  # of the robot itself
    assert execute(plant, act("move_base", x=0.0, y=1.0, speed=0.4), allow, 1e9).completed


def test_a_predicate_that_depends_on_a_parameter_is_another_fact_for_each_value() -> None:
    cooked = {
        "handling.cooked": replace(
            STATE["cooked"], variable=t.Variable("handling.cooked", BOOL, t.VariableRole.STATE)
        )
    }
    pot = Declared(t.Variable("handling.pot", EnumType("pots", ("a", "b")), t.VariableRole.STATE), SPAN)
    done = Outcome("done", {"handling.cooked": True}, False, None, None)
    ecm = module(done)["handling"]
    task = build(Task, id="cook", parameters={"pot": TaskParameter("pot", pot, "a")})
    perceiver = build(
        Perceiver, id="see", read_as={"pot": "handling.pot"}, provides=("handling.cooked",), rate=None
    )
    ecm = replace(
        ecm,
        tasks={"cook": task},
        state={**cooked, "handling.pot": pot},
        perceivers={"see": perceiver},
    )
    plant = SymbolicPlant(site(), {"handling": ecm}, 0)

    def cooked_now() -> Any:
        return plant.observe()["handling.cooked"].value

    def cook() -> None:
        plant.skill_began("handling.lift")
        plant.skill_ended("handling.lift", finished=True)

    cook()
    assert cooked_now() is True
    plant.set_parameters({"handling.pot": "b"})
    assert (plant.observe()["handling.pot"].value, cooked_now()) == ("b", False)
    cook()
    assert cooked_now() is True
    plant.set_parameters({"handling.pot": "a"})
    assert (plant.observe()["handling.pot"].value, cooked_now()) == ("a", True)
    assert plant.reset(0).observe()["handling.cooked"].value is False


def test_an_action_of_another_word_has_the_effect_of_what_it_means() -> None:
    other = replace(kind("move_tool"), name="reach_to", means="move_tool")
    plant = SymbolicPlant(replace(site(), kinds={**site().kinds, "reach_to": other}), {}, 0)
    execute(plant, act("reach_to", target=(0.3, 0.2, 0.1), yaw=0.0, speed=0.5), watch, 100.0)
    assert values(plant)["tool_position"] == (0.3, 0.2, 0.1)
