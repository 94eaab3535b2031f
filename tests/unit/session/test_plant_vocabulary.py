"""A plant whose measurements the site does not declare is refused before anything starts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.agent.execution.journal import Observer
from aeros.runtime.ports import Plant, Reading, Readings
from aeros.runtime.proving import prove_configuration
from aeros.session.assembly import SessionSetup, open_recorded_plant
from aeros.session.plant_factory import PlantSetupError
from aeros.session.plant_vocabulary import require_declared_measurements, require_known_actions
from aeros.sim.kinematic.plant import make_plant
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import ANGLE, TIME
from aeros.spec.model.site import Site
from aeros.spec.scenes.load import load_scene
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT

SITE_WORDS = {"move_tool": "reach_to", "grip": "pinch", "look": "snap", "wait": "rest"}


def renamed_site(folder: Path, *, means: bool) -> Path:
    """Write the reference site with other names of some actions."""
    text = reference_site_path().read_text()
    for word, own in SITE_WORDS.items():
        meaning = f"\n    means: {word}" if means else ""
        text = re.sub(rf"^  {word}:$", f"  {own}:{meaning}", text, flags=re.MULTILINE)
        text = re.sub(rf"(on: \[[^\]]*)\b{word}\b", rf"\g<1>{own}", text)
        text = re.sub(rf"^    {word}:", f"    {own}:", text, flags=re.MULTILINE)
        text = re.sub(rf"(gripped_by: \[|\{{arm: ){word}\b", rf"\g<1>{own}", text)
    path = folder / "site.yaml"
    path.write_text(text)
    return path


class Measuring:
    """A plant that measures given values, and can do nothing else."""

    def __init__(self, **values: Any) -> None:
        self._values = values

    def observe(self) -> Readings:
        return {name: Reading(value, 0.0) for name, value in self._values.items()}


def reference() -> Site:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


def without(site: Site, *names: str) -> Site:
    return replace(site, state={name: one for name, one in site.state.items() if name not in names})


def refusal(site: Site, **values: Any) -> list[str]:
    with pytest.raises(PlantSetupError) as refused:
        require_declared_measurements(cast("Plant", Measuring(**values)), site)
    return str(refused.value).splitlines()


def test_the_message_lists_every_variable_as_the_reference_site_declares_it() -> None:
    site = without(reference(), "holding", "joint_velocity", "tool_position")
    values = {"tool_position": (0.0, 0.0, 0.0), "joint_velocity": (0.0,) * 7, "holding": False}
    first, *lines = refusal(site, **values, tool_speed=0.0)
    assert "the plant measures 3 state variables that the site `panda_cell` does not declare" in first
    assert lines == [
        "  holding: {type: bool, sensor: gripper, max_age: 50 ms}",
        "  joint_velocity: {type: real, index: joints, unit: rad/s, range: [-20, 20], "
        "sensor: joint_encoders, max_age: 50 ms}",
        "  tool_position: {type: vec3, unit: m, range: [-10, 10], sensor: joint_encoders, max_age: 50 ms}",
    ]


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (True, "bool"),
        (0.5, "real, unit: UNIT, range: [LOW, HIGH]"),
        ((0.0, 1.0, 2.0), "vec3, unit: UNIT, range: [LOW, HIGH]"),
        ((0.0, 1.0), "real, index: ENUM, unit: UNIT, range: [LOW, HIGH]"),
    ],
)
def test_a_variable_of_another_robot_is_declared_by_its_value(value: Any, kind: str) -> None:
    first, line = refusal(reference(), wrist=value)
    assert "1 state variable that" in first
    assert line == f"  wrist: {{type: {kind}, sensor: SENSOR, max_age: 50 ms}}"


def test_a_variable_of_a_module_and_one_that_is_not_measured_are_no_errors() -> None:
    plant = cast("Plant", Measuring(**{"clean_table.bin_position": (0.0, 0.0, 0.0)}))
    require_declared_measurements(plant, reference())


def test_the_simulators_measure_only_what_the_reference_site_declares() -> None:
    plant = make_plant(load_scene("bare"), 0)
    require_declared_measurements(plant, reference())
    measured = plant.observe().keys()
    plant.close()
    with pytest.raises(PlantSetupError) as refused:
        require_declared_measurements(
            cast("Plant", Measuring(**dict.fromkeys(measured, 0.0))), replace(reference(), state={})
        )
    page = (ROOT / "docs" / "plants.md").read_text()
    for line in str(refused.value).splitlines()[1:]:
        assert line.split(", sensor: ")[0] in page


def test_a_session_is_refused_when_its_plant_opens(tmp_path: Path) -> None:
    configuration = prove_configuration(
        [ROOT / "ecms" / "inspect_table"], reference_site_path(), certified=False
    )[0]

    @contextmanager
    def opened(_: Observer) -> Iterator[Plant]:
        yield cast("Plant", Measuring(wrist=0.5))

    setup = SessionSetup(
        configuration=configuration, open_plant=opened, out=tmp_path, state=None, warn=lambda _: None
    )
    with pytest.raises(PlantSetupError, match="wrist"), open_recorded_plant(setup):
        pass


class Acting(Measuring):
    """A plant that says which action kinds it can do."""

    action_kinds = ("grip", "look", "move_base", "move_tool", "slide", "stop", "wait")


@pytest.mark.parametrize("means", [True, False])
def test_a_site_with_other_words_for_actions_suits_a_simulator_if_it_says_what_they_mean(
    tmp_path: Path, *, means: bool
) -> None:
    site = renamed_site(tmp_path, means=means)
    configuration = prove_configuration([ROOT / "ecms" / "fetch_object"], site, certified=False)[0]
    require_known_actions(cast("Plant", Measuring()), configuration)
    plant = cast("Plant", Acting())
    if means:
        require_known_actions(plant, configuration)
        return
    with pytest.raises(PlantSetupError) as refused:
        require_known_actions(plant, configuration)
    first, *lines = str(refused.value).splitlines()
    assert "cannot do 3 action kinds of the site `panda_cell` that the modules need" in first
    assert lines == [
        "  pinch: {means: grip, …}",
        "  reach_to: {means: move_tool, …}",
        "  snap: {means: look, …}",
    ]


def test_the_words_of_a_simulator_with_other_parameters_do_not_suit_it(tmp_path: Path) -> None:
    site = renamed_site(tmp_path, means=True)
    configuration = prove_configuration([ROOT / "ecms" / "fetch_object"], site, certified=False)[0]
    kinds = dict(configuration.site.kinds)
    name = next(one for one, kind in kinds.items() if kind.plant_word == "move_tool")
    speed = kinds[name].parameters["speed"]
    turning = replace(speed, variable=replace(speed.variable, type=RealType(ANGLE * TIME**-1)))
    kinds[name] = replace(kinds[name], parameters={**kinds[name].parameters, "speed": turning})
    other = replace(configuration, site=replace(configuration.site, kinds=kinds))
    require_known_actions(cast("Plant", Measuring()), other)
    with pytest.raises(
        PlantSetupError, match="parameters are not those of the plant's `move_tool`: `speed` is"
    ):
        require_known_actions(cast("Plant", Acting()), other)
