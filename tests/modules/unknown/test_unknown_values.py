"""Skills of the shipped modules come to an end, without an exception, with any perceived values unknown."""

from __future__ import annotations

import runpy
from contextlib import suppress
from functools import cache
from inspect import signature
from random import Random
from types import SimpleNamespace
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.text.discovery import reference_site_path
from tests.modules.robot import default_inputs
from tests.repo.tree import ROOT

MODULES: Final = ("ecms/clean_table", "ecms/fetch_object", "ecms/make_dumplings", "learned/hold_sponge")
"""Those with perceivers."""

MOST_ACTIONS: Final = 2000
"""More than any skill needs: those that wait for a reading give up after 10 s."""

OBSERVED: Final[dict[str, Any]] = {
    "holding": False,
    "finger_gap": 0.06,
    "tool_position": (0.4, 0.0, 0.2),
    "base_position": (0.0, 0.0, 0.0),
    "dock_position": (0.0, 0.0, 0.0),
    # clean_table, hold_sponge
    "region": "left",
    "area_position": (0.5, 0.0, 0.0),
    "sponge_rest_position": (0.45, 0.34, 0.015),
    "bin_position": (0.45, -0.5, 0.085),
    "sponge_position": (0.5, 0.25, 0.015),
    "sponge_top": 0.06,
    "sponge_spot": (0.45, 0.22, 0.015),
    "sponge_yaw": 0.0,
    "clutter_position": (0.4, -0.25, 0.02),
    "clutter_yaw": 0.3,
    "clutter_length": 0.04,
    "clutter_ungraspable": False,
    "clutter_ungraspable_position": (0.5, -1.2, 0.05),
    "wiped_fraction": 0.5,
    "sponge_floor_position": (0.15, -0.9, -0.3),
    "piece_floor_position": (0.15, -0.9, -0.3),
    "table_lift": 0.0,
    "clutter_last_seen": (0.4, -0.25, 0.02),
    "overhead_turn": 0.0,
    "overhead_shift": (0.0, 0.0, 0.0),
    "overhead_residual": 0.002,
    # make_dumplings
    "press_position": (0.5, 0.0, 0.083),
    "press_handle_position": (0.425, 0.0, 0.094),
    "press_force": 0.0,
    "pot_position": (0.55, 0.33, 0.055),
    "count": 2,
    "dumplings_cooked": 1,
    "wrapper_position": (0.41, -0.07, 0.063),
    "wrapper_yaw": 0.1,
    "wrapper_fold": 0.0,
    "filling_position": (0.34, 0.235, 0.058),
    "bench_lift": 0.0,
    "filling_yaw": 0.1,
    "other_wrapper_position": (0.6, -0.34, 0.063),
    "blocker_position": (0.5, 0.0, 0.083),
    "covered_place": (0.5, 0.0, 0.083),
    "blocker_yaw": 0.0,
    "aside_place": (0.58, 0.14, 0.02),
    "other_filling_position": (0.36, -0.14, 0.058),
    "push_start": (0.4, -0.2, 0.012),
    "push_end": (0.45, -0.2, 0.012),
    "push_yaw": 0.0,
    "pot_place": (0.55, 0.33, 0.055),
    "hidden_place": (0.6, -0.34, 0.0),
    "wrapper_last_seen": (0.41, -0.07, 0.063),
    "wrappers_lost": 0,
    "wrappers_out_of_reach": 0,
    "wrappers_shut": 0,
    "wrappers_not_folding": 0,
    "wrappers_too_large": 0,
    "wrappers_without_room": 0,
    "fillings_lost": 0,
    "fillings_out_of_reach": 0,
    "fillings_without_room": 0,
    # fetch_object
    "station_survey": (1.2, 0.16, 0.3),
    "station_position": (1.2, 0.16, 0.3),
    "delivery_position": (1.7, -1.1, 0.44),
    "object_position": (1.8, 0.18, 0.44),
    "stand_lift": 0.0,
    "object_expected_place": (1.7, -1.1, 0.44),
    "object_scale": 1.0,
    "delivery_aside": 0.1,
    "delivery_offset": 0.12,
    "delivery_yaw": 1.5,
    "object_aside": 0.0,
    "wrapper_scale": 1.0,
    "object_place": (1.7, -1.1, 0.44),
    "object": "blue_block",
    "to": "left",
    "object_yaw": 0.2,
    "object_seen_time": 1.0,
    "object_searched": 0.4,
    "object_dark_place": (1.7, -1.1, 0.44),
    "object_unlike_place": (1.7, -1.1, 0.44),
    "object_slips": 0,
    "object_distance": 0.6,
    "object_grip_offset": (0.0, 0.0, 0.0),
    "object_grip_height": 0.012,
    "object_push_start": (1.7, 0.1, 0.4),
    "object_push_way": (0.1, 0.05, 0.0),
}
"""A value of everything that is not true or false."""


@cache
def module(path: str) -> Ecm:
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    assert site is not None
    loaded = load_ecm(ROOT / path, site, diagnostics)
    assert loaded is not None
    return loaded.ecm


def perceived(ecm: Ecm) -> list[str]:
    """The variables that its perceivers provide, by its own names."""
    return sorted({name.rpartition(".")[2] for one in ecm.perceivers.values() for name in one.provides})


def skills() -> list[tuple[str, str]]:
    return [(path, skill) for path in MODULES for skill in module(path).skills]


@pytest.mark.parametrize(("path", "skill"), skills())
@given(chance=st.integers(0, 2**32).map(Random), share=st.sampled_from((0.02, 0.2, 0.9)))
def test_a_skill_ends_with_any_values_unknown(path: str, skill: str, chance: Random, share: float) -> None:
    ecm = module(path)
    seen = perceived(ecm)

    def observed() -> dict[str, Any]:
        truths = {name: chance.random() < 0.5 for name in (*seen, "holding") if name not in OBSERVED}
        gap = chance.choice((0.0, 0.022, 0.044, 0.056, 0.08))
        moment = {**OBSERVED, **truths, "holding": chance.random() < 0.5, "finger_gap": gap}
        return {name: one for name, one in moment.items() if name not in seen or chance.random() >= share}

    function = runpy.run_module(f"{path.replace('/', '.')}.skills")[skill]
    policy = SimpleNamespace(run=lambda offset: {"step": offset})
    models = [{"policy": policy}] if len(signature(function).parameters) == 3 else []
    body = function(observed(), default_inputs(ecm.skills[skill]), *models)
    try:
        action = next(body)
        for _ in range(MOST_ACTIONS):
            assert isinstance(action, Action)
            action = body.send(observed())
    except StopIteration:
        return
    pytest.fail("it does not end")


def test_every_value_is_given() -> None:
    for path in MODULES:
        ecm = module(path)
        numbers = {
            name.rpartition(".")[2] for name, one in ecm.state.items() if str(one.variable.type) != "bool"
        }
        assert numbers <= OBSERVED.keys()


@pytest.mark.parametrize(
    ("path", "skill", "unknown", "truths"),
    [
        ("ecms/make_dumplings", "prepare", "filling_position", {"dough_on_workspace": True}),
        ("ecms/make_dumplings", "recover", "wrapper_position", {}),
        ("ecms/clean_table", "wipe", "sponge_position", {"clutter_on_table": False, "sponge_seen": False}),
        ("learned/hold_sponge", "take", "sponge_position", {}),
    ],
)
def test_an_object_that_no_picture_shows_is_looked_for_again_and_then_left(
    path: str, skill: str, unknown: str, truths: dict[str, bool]
) -> None:
    code = runpy.run_module(f"{path.replace('/', '.')}.skills")
    without = {name: value for name, value in OBSERVED.items() if name != unknown} | truths
    models: list[Any] = [{}] if path.startswith("learned/") else []
    body = code[skill](without, default_inputs(module(path).skills[skill]), *models)
    actions = [next(body)]
    with suppress(StopIteration):
        while True:
            actions.append(body.send(without))
    assert code["LOOKS"] <= sum(one.kind == "look" for one in actions) <= 3 * code["LOOKS"]
    assert not any(one.kind == "grip" for one in actions)
