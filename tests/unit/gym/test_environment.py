"""Environments of Gymnasium as its users make them: checked by its own checker, seeded, in vectors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import aeros.gym
from aeros.agent.errors import AgentError
from aeros.gym.cell import EpisodeInCell
from aeros.runtime.audit.log import verify_log
from aeros.runtime.ports import MotionHandle, PlannedMotion
from aeros.sim.fake import FakePlant
from aeros.sim.referee import GoalJudgement
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from tests.repo.tree import ROOT

_DUMPLINGS = "aeros/MakeDumplings-v0"

aeros.gym.register_modules(ROOT / "ecms")

_PREPARE, _WRAP, _BOIL = 2, 4, 5


@pytest.fixture(scope="module")
def dumplings() -> Iterator[aeros.gym.TaskEnvironment]:
    made = aeros.gym.TaskEnvironment(ROOT / "ecms/make_dumplings", "make dumplings")
    yield made
    made.close()


def _request(env: gymnasium.Env[Any, Any], x: float) -> dict[str, Any]:
    """A target of the tool in the middle of a bench, at a distance x (m) from the arm."""
    action: dict[str, Any] = env.action_space.sample()
    action["kind"] = np.int64(0)
    action["move_tool.target"] = np.array([x, 0.0, 0.3]) / 10.0
    action["move_tool.yaw"] = np.zeros(1)
    action["move_tool.speed"] = np.array([-0.95])
    return action


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(_same(*pair) for pair in zip(one, other, strict=True))
    return np.array_equal(one, other) if isinstance(one, np.ndarray) else bool(one == other)


def _run(env: gymnasium.Env[Any, Any], seed: int, actions: Sequence[Any]) -> list[Any]:
    steps: list[Any] = [env.reset(seed=seed)]
    steps += [env.step(action) for action in actions]
    return steps


class Robot(FakePlant):
    """A plant that does not wait for its monitor."""

    runs_in_real_time = True
    is_closed = False

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle:
        raise AssertionError("a robot was moved")

    def close(self) -> None:
        self.is_closed = True


def test_a_plant_that_turns_out_to_be_a_robot_is_refused_before_it_moves(
    dumplings: aeros.gym.TaskEnvironment, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = Robot({})
    monkeypatch.setattr("aeros.gym.cell.open_plant", lambda *_, **__: closing(robot))
    with pytest.raises(MisuseError, match="the plant `symbolic` runs in real time, as a robot does"):
        dumplings.reset(seed=0)
    assert robot.is_closed


@pytest.mark.parametrize(
    "id_",
    [
        _DUMPLINGS,
        pytest.param("aeros/CleanTable-v0", marks=pytest.mark.deep),
        pytest.param("aeros/FetchObject-v0", marks=pytest.mark.deep),
    ],
)
def test_the_checker_of_gymnasium_finds_nothing(id_: str) -> None:
    with closing(gymnasium.make(id_)) as env:
        check_env(env.unwrapped)


@pytest.mark.parametrize(
    "options",
    [
        {"actions": "requests", "skill": "make_dumplings.prepare"},
        pytest.param({"actions": "skills-with-inputs"}, marks=pytest.mark.deep),
    ],
)
def test_the_checker_finds_nothing_with_other_action_spaces(options: dict[str, Any]) -> None:
    with closing(gymnasium.make(_DUMPLINGS, **options)) as env:
        check_env(env.unwrapped)


def test_the_reward_is_the_goal_which_ends_the_episode(dumplings: aeros.gym.TaskEnvironment) -> None:
    steps = _run(dumplings, 0, (_PREPARE, _WRAP, _BOIL))
    assert [(reward, ended) for _, reward, ended, _, _ in steps[1:]] == [
        (0.0, False),
        (0.0, False),
        (1.0, True),
    ]
    info = steps[-1][4]
    assert (info["skill"], info["status"], info["outcome"]) == ("make_dumplings.boil", "finished", "cooked")
    assert (info["is_success"], info["is_believed"], info["is_refereed"]) == (True, True, False)


def test_a_goal_that_is_believed_and_false_earns_nothing(
    dumplings: aeros.gym.TaskEnvironment, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(EpisodeInCell, "judge", lambda *_: GoalJudgement(True, False, {}))
    _, reward, ended, _, info = _run(dumplings, 7, (_PREPARE,))[-1]
    assert (reward, ended, info["is_success"], info["is_believed"]) == (0.0, False, False, True)


def test_a_goal_that_is_true_and_not_believed_earns_the_reward(
    dumplings: aeros.gym.TaskEnvironment, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(EpisodeInCell, "judge", lambda *_: GoalJudgement(False, True, {}))
    _, reward, ended, _, info = _run(dumplings, 7, (_PREPARE,))[-1]
    assert (reward, ended, info["is_success"], info["is_refereed"]) == (1.0, True, True, True)


def test_the_same_seed_and_actions_give_the_same_bit_for_bit(dumplings: aeros.gym.TaskEnvironment) -> None:
    actions = (_PREPARE, _WRAP, _BOIL)
    assert _same(_run(dumplings, 3, actions), _run(dumplings, 3, actions))


def test_seeds_differ(dumplings: aeros.gym.TaskEnvironment) -> None:
    outcomes = [_run(dumplings, seed, (_PREPARE,))[-1][4]["outcome"] for seed in (6, 7)]
    assert outcomes == ["laid_out", "missed"]


def test_an_episode_without_a_seed_continues_the_seeded_sequence(
    dumplings: aeros.gym.TaskEnvironment,
) -> None:
    def two() -> list[int]:
        dumplings.reset(seed=1)
        return [dumplings.reset()[1]["seed"], dumplings.reset()[1]["seed"]]

    first, second = two(), two()
    assert first == second
    assert first[0] != first[1]


def test_a_skill_that_may_not_start_changes_nothing(dumplings: aeros.gym.TaskEnvironment) -> None:
    (before, info), (after, reward, ended, _, steps) = _run(dumplings, 0, (_BOIL,))
    assert info["action_mask"][_BOIL] == 0
    assert (steps["status"], steps["time"], reward, ended) == ("refused", 0.0, 0.0, False)
    assert "dumpling_wrapped" in steps["reason"]
    assert _same(before, after)


def test_an_unknown_value_has_a_flag(dumplings: aeros.gym.TaskEnvironment) -> None:
    observation, _ = dumplings.reset(seed=0)
    known = dict(zip(dumplings.observation_names, observation["known"], strict=True))
    values = dict(zip(dumplings.observation_names, observation["values"], strict=True))
    assert known["make_dumplings.push_start.x"] == 0
    assert values["make_dumplings.push_start.x"] == 0.0
    assert known["tool_position.x"] == 1
    assert values["tool_position.x"] == pytest.approx(0.307)


def test_a_denied_action_names_its_rules() -> None:
    env = gymnasium.make(_DUMPLINGS, actions="requests", skill="make_dumplings.prepare")
    env.action_space.seed(0)
    (_, first), near, far = _run(env, 0, (_request(env, 0.5), _request(env, 3.0)))
    assert near[4]["status"] == "finished"
    assert near[4]["objections"] == []
    assert near[4]["time"] > first["time"]
    info = far[4]
    assert (info["status"], info["allowed"], info["denied"], info["has_failed"]) == ("denied", 0, 1, True)
    (objection,) = info["objections"]
    assert objection["verdict"] == "DENY"
    assert objection["asked"]["parameters"]["target"][0] == pytest.approx(3.0)
    assert "workspace" in objection["rules"]
    env.close()


def test_bounds_scale_the_numbers_of_an_action() -> None:
    env = gymnasium.make(
        _DUMPLINGS,
        actions="requests",
        skill="make_dumplings.prepare",
        bounds={"move_tool.target": ((0.4, -0.2, 0.2), (0.6, 0.2, 0.4)), "move_tool.speed": (0.1, 0.3)},
    )
    env.action_space.seed(0)
    env.reset(seed=0)
    action = {**_request(env, 0.0), "move_tool.target": np.ones(3), "move_tool.speed": -np.ones(1)}
    observation, *_, info = env.step(action)
    assert info["status"] == "finished"
    names: tuple[str, ...] = env.get_wrapper_attr("observation_names")
    found = [observation["values"][names.index(f"tool_position.{axis}")] for axis in "xyz"]
    assert found == pytest.approx([0.6, 0.2, 0.4])
    env.close()


@pytest.mark.parametrize("mode", [pytest.param("sync", marks=pytest.mark.deep), "async"])
def test_environments_in_a_vector_do_as_one_does(mode: str, dumplings: aeros.gym.TaskEnvironment) -> None:
    vector = gymnasium.make_vec(_DUMPLINGS, num_envs=2, vectorization_mode=mode)
    try:
        observed, _ = vector.reset(seed=4)
        stepped, rewards, *_ = vector.step(np.array([_PREPARE, _BOIL]))
    finally:
        vector.close()
    for place, (seed, action) in enumerate(((4, _PREPARE), (5, _BOIL))):
        (first, _), (second, reward, *_) = _run(dumplings, seed, (action,))
        assert all(np.array_equal(observed[key][place], first[key]) for key in first)
        assert all(np.array_equal(stepped[key][place], second[key]) for key in second)
        assert rewards[place] == reward


def test_each_episode_has_an_audit_log_of_its_own(tmp_path: Path) -> None:
    env = aeros.gym.TaskEnvironment(ROOT / "ecms/make_dumplings", "make dumplings", out=tmp_path)
    _run(env, 0, (_PREPARE,))
    _run(env, 1, ())
    env.close()
    logs = sorted(tmp_path.glob("*/audit.jsonl"))
    assert [path.parent.name for path in logs] == ["episode-000000", "episode-000001"]
    assert all(verify_log(path).is_sound for path in logs)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"plant": "symbolical"}, "did you mean `symbolic`"),
        ({"actions": "skill"}, "did you mean `skills`"),
        ({"gate": "off"}, "there is no gate mode `off`"),
        ({"skill": "make_dumplings.wrap"}, "`skill` is for"),
        ({"actions": "requests"}, "the skill is None"),
        ({"render_mode": "rgb_array"}, "has no cameras"),
        ({"bounds": {"move_tool.speed": (0.0, 0.1)}}, "no number to bound `move_tool.speed`"),
    ],
    ids=lambda one: "" if isinstance(one, str) else next(iter(one)),
)
def test_a_wrong_argument_is_named(options: dict[str, Any], text: str) -> None:
    with pytest.raises(MisuseError, match=text):
        aeros.gym.TaskEnvironment(ROOT / "ecms/make_dumplings", "make dumplings", **options)


def test_each_module_of_a_folder_has_an_environment(tmp_path: Path) -> None:
    for name in ("make_tea", "wait", "no_module"):
        (tmp_path / name).mkdir()
        if name != "no_module":
            (tmp_path / name / "ecm.yaml").write_text("")
    assert aeros.gym.register_modules(tmp_path) == ["aeros/MakeTea-v0", "aeros/Wait-v0"]
    assert gymnasium.spec("aeros/MakeTea-v0").kwargs == {"modules": str(tmp_path / "make_tea")}
    for name in ("aeros/MakeTea-v0", "aeros/Wait-v0"):
        del gymnasium.registry[name]


def test_several_tasks_need_an_instruction() -> None:
    with pytest.raises(MisuseError, match=r"give an `instruction`.*`make_dumplings\.make_dumplings`"):
        aeros.gym.TaskEnvironment([ROOT / "ecms" / "make_dumplings", ROOT / "ecms" / "clean_table"])


def test_an_instruction_that_nothing_understands_is_refused() -> None:
    with pytest.raises(AgentError, match="juggle"):
        aeros.gym.TaskEnvironment(ROOT / "ecms/make_dumplings", "juggle")


def test_a_step_needs_an_episode_and_an_action_of_the_space(dumplings: aeros.gym.TaskEnvironment) -> None:
    dumplings.reset(seed=0)
    dumplings._end_episode()
    with pytest.raises(MisuseError, match="call `reset`"):
        dumplings.step(0)
    dumplings.reset(seed=0)
    with pytest.raises(MisuseError, match="is not in Discrete"):
        dumplings.step(17)
    with pytest.raises(MisuseError, match="takes a seed only"):
        dumplings.reset(options={"difficulty": 3})


@pytest.mark.physics
@pytest.mark.parametrize("plant", [pytest.param("physics", marks=pytest.mark.deep), "mujoco"])
def test_physics_is_refereed_rendered_and_repeatable(plant: str) -> None:
    env = gymnasium.make(
        _DUMPLINGS,
        plant=plant,
        actions="requests",
        skill="make_dumplings.prepare",
        camera="overhead",
        render_mode="rgb_array",
    )
    env.action_space.seed(0)
    look = {**_request(env, 0.5), "kind": np.int64(2)}
    assert env.get_wrapper_attr("_decoder").kind_names[2] == "look"
    actions = (_request(env, 0.45), look)
    first = _run(env, 3, actions)
    picture: Any = env.render()
    assert picture.shape == (240, 320, 3)
    assert len(np.unique(picture)) > 50
    assert [one[4]["is_refereed"] for one in first[1:]] == [True, True]
    assert _same(first, _run(env, 3, actions))
    env.close()


@pytest.mark.deep
@pytest.mark.physics
@pytest.mark.parametrize("plant", ["physics", "mujoco"])
def test_dumplings_on_physics_earn_the_reward_by_truth(plant: str) -> None:
    env = gymnasium.make(_DUMPLINGS, plant=plant)
    steps = _run(env, 0, (_PREPARE, _WRAP, _BOIL))
    assert [one[1] for one in steps[1:]] == [0.0, 0.0, 1.0]
    assert steps[-1][4]["is_refereed"] is True
    assert _same(steps, _run(env, 0, (_PREPARE, _WRAP, _BOIL)))
    env.close()
