"""Names under `truth` of a scene are state variables of its module or of the site."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.scenes.load import add_scene, load_scene

VARIABLES: dict[str, dict[str, tuple[str, ...]]] = {
    "garden": {"bed_planted": (), "bed_wet": (), "left_bed_dry": (), "side": ("left", "right")},
    "kitchen": {"pot_full": ()},
    "": {"holding": ()},
}


def write(folder: Path, truth: str, *, module: str = "", name: str = "scene", more: str = "") -> str:
    """A scene file with these lines under `truth`."""
    path = folder / f"{name}.yaml"
    owner = f"module: {module}\n" if module else ""
    path.write_text(f"schema: aeros/scene/2\ndescription: Things.\n{owner}{more}truth:\n{truth}\n")
    return str(path)


def refused(file: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(UserError) as error:
        load_scene(file, variables=VARIABLES)
    return tuple(error.value.diagnostics)


def test_an_unknown_name_is_refused_at_its_place_with_the_name_that_it_is_near(tmp_path: Path) -> None:
    (found,) = refused(write(tmp_path, "  holding: true\n  bed_plantd: holding", module="garden"))
    assert (found.code, found.headline) == (
        "AE122",
        "`bed_plantd` is not a state variable of `garden` or of the site",
    )
    assert found.help == ("did you mean `bed_planted`?",)
    assert found.primary is not None
    span = found.primary.span
    assert (span.source.path, span.line, span.text) == (str(tmp_path / "scene.yaml"), 6, "bed_plantd")


def test_a_scene_of_a_module_does_not_define_variables_of_another_one(tmp_path: Path) -> None:
    (found,) = refused(write(tmp_path, "  pot_full: true", module="garden"))
    assert found.headline == "`pot_full` is not a state variable of `garden` or of the site"


def test_a_full_name_defines_a_variable_of_another_module(tmp_path: Path) -> None:
    file = write(tmp_path, "  kitchen.pot_full: true\n  bed_wet: kitchen.pot_full", module="garden")
    assert list(load_scene(file, variables=VARIABLES).truth) == ["kitchen.pot_full", "garden.bed_wet"]
    (found,) = refused(write(tmp_path, "  kitchen.pot_ful: true", module="garden"))
    assert found.headline == "`pot_ful` is not a state variable of `kitchen`"
    absent = write(tmp_path, "  cellar.anything: true", module="garden")
    assert list(load_scene(absent, variables=VARIABLES).truth) == ["cellar.anything"]


def test_a_full_name_replaces_the_truth_of_an_included_scene_for_all_parameters(tmp_path: Path) -> None:
    small, large = "{sphere: 3 cm, at: [0 m, 0 m, 1 m]}", "{sphere: 5 cm, at: [1 m, 0 m, 1 m]}"
    pot = f"bodies:\n  small: {small}\n  large: {large}\n"
    choice = "parameters: {pot: {little: small, big: large}}\n"
    truths = "  pot_full: pot.tilt < 1 rad\n  pot_hot: pot_full"
    write(tmp_path, truths, module="kitchen", name="part", more=pot + choice)
    names = ["kitchen.pot_full(pot = little)", "kitchen.pot_full(pot = big)"]
    known: dict[str, tuple[str, ...]] = {"pot_full": (), "pot_hot": (), "pot": ("little", "big")}
    variables = {**VARIABLES, "kitchen": known}
    whole = write(
        tmp_path,
        "  kitchen.pot_full: large.tilt < 2 rad",
        module="garden",
        more="include: [{scene: part.yaml}]\n",
    )
    truth = load_scene(whole, variables=variables).truth
    assert {truth[name].text for name in names} == {"large.tilt < 2 rad"}
    assert set(truth) == {*names, "kitchen.pot_hot(pot = little)", "kitchen.pot_hot(pot = big)"}


def test_a_scene_of_no_module_may_define_those_of_any(tmp_path: Path) -> None:
    file = write(tmp_path, "  pot_full: true\n  bed_wet: true\n  holding: true")
    assert list(load_scene(file, variables=VARIABLES).truth) == ["pot_full", "bed_wet", "holding"]
    (found,) = refused(write(tmp_path, "  pot_ful: true"))
    assert found.headline == "`pot_ful` is not a state variable of a module or of the site"


@pytest.mark.parametrize("variables", [None, {"": {"holding": ()}}])
def test_names_of_a_module_that_is_not_there_are_not_checked(
    variables: dict[str, dict[str, tuple[str, ...]]] | None, tmp_path: Path
) -> None:
    file = write(tmp_path, "  anything: true", module="garden")
    assert list(load_scene(file, variables=variables).truth) == ["garden.anything"]


@pytest.mark.parametrize(("name", "is_known"), [("bed_dry", True), ("bed_wet", True), ("bed", False)])
def test_a_prefix_belongs_to_the_names_of_a_file_that_is_included(
    name: str, is_known: bool, tmp_path: Path
) -> None:
    write(tmp_path, f"  {name}: true", module="garden", name="part")
    whole = write(
        tmp_path, "  holding: true", more="include:\n- {scene: part.yaml, prefix: left_}\n", module="garden"
    )
    if is_known:
        assert f"garden.left_{name}" in load_scene(whole, variables=VARIABLES).truth
    else:
        assert [one.code for one in refused(whole)] == ["AE122"]


@pytest.mark.parametrize(
    ("parameters", "headline"),
    [
        ("{side: {left: pot, right: pot}}", None),
        ("{side: {left: pot}}", None),
        ("{sid: {left: pot}}", "`sid` is not a parameter of `garden` with named values"),
        (
            "{bed_wet: {left: pot}}",
            "`bed_wet` is not a parameter of `garden` with named values",
        ),
        ("{side: {lefft: pot}}", "`lefft` is not a value of `side`"),
    ],
)
def test_parameters_and_their_values_are_those_of_the_module(
    parameters: str, headline: str | None, tmp_path: Path
) -> None:
    pot = "bodies:\n  pot: {sphere: 3 cm, at: [0 m, 0 m, 1 m]}\n"
    parameter = parameters[1:].partition(":")[0]
    truth = f"  bed_wet: {parameter}.tilt < 1 rad"
    file = write(tmp_path, truth, module="garden", more=f"{pot}parameters: {parameters}\n")
    if headline is None:
        truths = load_scene(file, variables=VARIABLES).truth
        assert {name.partition("(")[0] for name in truths} == {"garden.bed_wet"}
    else:
        assert [one.headline for one in refused(file)] == [headline]


def test_a_parameter_that_no_truth_uses_is_a_fault(tmp_path: Path) -> None:
    pot = "bodies:\n  pot: {sphere: 3 cm, at: [0 m, 0 m, 1 m]}\n"
    used = f"{pot}parameters: {{side: {{left: pot}}}}\n"
    write(tmp_path, "  bed_wet: side.tilt < 1 rad", module="garden", name="part", more=used)
    including = "include: [{scene: part.yaml}]\nparameters: {side: {right: pot}}\n"
    (found,) = refused(write(tmp_path, "  holding: true", module="garden", more=including))
    assert found.headline == "no `truth` of this file uses the parameter `side`"
    assert "`garden.bed_wet`" in found.help[1]


def test_a_scene_that_is_added_is_checked_as_well(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, "  bed_wet: true", module="garden"))
    with pytest.raises(UserError, match="`bed_dri` is not a state variable"):
        add_scene(
            scene, write(tmp_path, "  bed_dri: true", module="garden", name="more"), variables=VARIABLES
        )
