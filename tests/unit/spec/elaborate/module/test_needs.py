"""Needs and parameters of a module: bound by the operator, by the site, by name, or as the only choice."""

from __future__ import annotations

import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.load import decode_manifest, load_ecm, load_site
from aeros.spec.elaborate.module.needs import ModuleNeeds, module_settings
from aeros.spec.elaborate.module.settings import Setting
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.site import Site
from aeros.spec.verification.verify import verify
from tests.unit.spec.faults import CORPUS, TABLE

MODULE = "waits_less_than_allowed"
BOUND = ModuleConfiguration({"surface": "tabletop"})
NEEDS = """\
needs:
  surface: {is: volume}
  top: {is: constant, unit: m/s}

parameters:
  pause: {type: real, unit: s, range: [1, 20], default: 10 s}
  number: {type: int, range: [1, 5], default: 2}

capabilities:
"""


@pytest.fixture
def site() -> Site:
    found = load_site(TABLE, Diagnostics())
    assert found is not None
    return found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A module that needs one of two volumes, the only speed, and two parameters."""
    copied = Path(shutil.copytree(CORPUS / "accepted" / MODULE, tmp_path / MODULE))
    manifest = copied / "ecm.yaml"
    text = manifest.read_text()
    assert text.count("capabilities:\n") == 1
    assert text.count("wait: duration <= 10 s") == 1
    text = text.replace("capabilities:\n", NEEDS).replace(
        "wait: duration <= 10 s", "wait: duration <= pause and number < 3"
    )
    manifest.write_text(text)
    return copied


def settings(folder: Path, site: Site) -> dict[str, Setting]:
    declared = decode_manifest(folder)
    assert declared is not None
    return {one.name: one for one in ModuleNeeds(declared, site, Diagnostics()).settings}


def elaborated(folder: Path, site: Site) -> tuple[Ecm | None, list[str]]:
    sink = Diagnostics()
    found = load_ecm(folder, site, sink)
    return None if found is None else found.ecm, [render_text(one) for one in sink]


def bound(site: Site, **bindings: str) -> Site:
    return site.with_configurations({MODULE: ModuleConfiguration(bindings)})


def test_a_need_with_several_choices_is_open(folder: Path, site: Site) -> None:
    found = settings(folder, site)
    assert found["surface"] == Setting("surface", "", ("tabletop", "camera_mast"), False, "", "a volume")
    assert found["surface"].is_open
    assert (found["top"].value, found["top"].source) == ("slow", "only choice")
    assert (found["pause"].value, found["pause"].source) == ("10 s", "default")
    ecm, problems = elaborated(folder, site)
    assert ecm is None
    assert len(problems) == 1
    assert "--bind waits_less_than_allowed.surface=tabletop" in problems[0]


def test_the_operator_comes_before_the_site_file(folder: Path, site: Site) -> None:
    of_file = replace(
        site, configurations={MODULE: ModuleConfiguration({"surface": "tabletop"}, {"pause": "3 s"})}
    )
    ecm, problems = elaborated(folder, of_file)
    assert problems == []
    assert ecm is not None
    assert ecm.configuration == {"surface": "tabletop", "top": "slow", "pause": "3 s", "number": "2"}
    ecm, _ = elaborated(folder, bound(of_file, surface="camera_mast"))
    assert ecm is not None
    assert ecm.configuration["surface"] == "camera_mast"
    assert ecm.configuration["pause"] == "3 s"


def test_a_need_of_the_name_of_a_thing_is_bound_to_it_unless_another_is_chosen(
    folder: Path, site: Site
) -> None:
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("surface:", "tabletop:"))
    assert settings(folder, site)["tabletop"].source == "same name"
    other = bound(site, tabletop="camera_mast")
    declared = decode_manifest(folder)
    assert declared is not None
    needs = ModuleNeeds(declared, other, Diagnostics())
    assert needs.names.bindings["tabletop"] == "camera_mast"
    assert needs.site.volumes["tabletop"] == site.volumes["camera_mast"]  # the module's word
    assert other.volumes == site.volumes  # the site's words stay


def test_a_variable_of_the_module_is_measured_by_the_sensor_that_a_need_is_bound_to(
    folder: Path, site: Site
) -> None:
    manifest = folder / "ecm.yaml"
    text = manifest.read_text().replace("needs:\n", "needs:\n  eye: {is: sensor}\n")
    own = "state:\n  dirt_seen: {type: bool, sensor: eye, max_age: 1 s}\n\ncapabilities:\n"
    manifest.write_text(text.replace("capabilities:\n", own))
    ecm, problems = elaborated(folder, bound(site, surface="tabletop", eye="camera"))
    assert problems == []
    assert ecm is not None
    assert ecm.state[f"{MODULE}.dirt_seen"].sensor == "camera"


def test_parameters_are_constants_of_the_module(folder: Path, site: Site) -> None:
    ecm, problems = elaborated(folder, bound(site, surface="tabletop"))
    assert problems == []
    assert ecm is not None
    assert unparse(ecm.skills["tidy"].envelope["wait"].term) == "(duration <= 10 s) and (2 < 3)"


@pytest.mark.parametrize(
    ("value", "code"),
    [
        ("21 s", "AE111"),
        ("0.5 s", "AE111"),
        ("3 N", "AE204"),
        ("3", "AE204"),
        ("3 s +", "AE201"),
        ("joint_angle", "AE202"),
        ("nonsense", "AE202"),
        ("1e400 s", "AE111"),
        ("-3 s", "AE111"),
    ],
)
def test_a_value_that_a_parameter_cannot_have_is_shown_where_it_was_given(
    folder: Path, site: Site, value: str, code: str
) -> None:
    given = ModuleConfiguration({"surface": "tabletop"}, {"pause": value})
    ecm, problems = elaborated(folder, site.with_configurations({MODULE: given}))
    assert ecm is None
    assert len(problems) == 1
    assert f"[{code}" in problems[0]
    assert "--set pause:1:" in problems[0]


def test_a_whole_number_stays_whole(folder: Path, site: Site) -> None:
    given = ModuleConfiguration({"surface": "tabletop"}, {"number": "2.5"})
    ecm, problems = elaborated(folder, site.with_configurations({MODULE: given}))
    assert ecm is None
    assert "--set number:1:" in problems[0]


@pytest.mark.parametrize("value", ["slow", "tools", "panel", "surface", "TABLETOP", "table"])
def test_a_binding_to_what_does_not_suit_is_refused(folder: Path, site: Site, value: str) -> None:
    ecm, problems = elaborated(folder, bound(site, surface=value))
    assert ecm is None
    assert f"`{value}` is not one" in problems[0]


def test_a_setting_that_the_module_does_not_declare_is_refused(folder: Path, site: Site) -> None:
    given = ModuleConfiguration({"surface": "tabletop", "surfaces": "x"}, {"pauses": "1 s"})
    ecm, problems = elaborated(folder, site.with_configurations({MODULE: given}))
    assert ecm is None
    assert ["did you mean `surface`?" in problems[0], "did you mean `pause`?" in problems[1]] == [True, True]


@pytest.mark.parametrize(("value", "is_open"), [("", True), ("tabletop", False), ("table", True)])
def test_a_need_is_open_unless_it_is_bound_to_something_that_suits(
    folder: Path, site: Site, value: str, is_open: bool
) -> None:
    declared = decode_manifest(folder)
    assert declared is not None
    found = module_settings(declared, bound(site, surface=value) if value else site)
    assert [one.name for one in found if one.is_open] == (["surface"] if is_open else [])
    without = decode_manifest(CORPUS / "accepted" / MODULE)
    assert without is not None
    assert module_settings(without, site) == ()


SEEING = """\
needs:
  eye: {is: camera, sees: surface}
  surface: {is: volume}
"""


@pytest.mark.parametrize("value", ["", "panel"])
def test_a_camera_is_not_missing_while_the_volume_that_it_must_see_is_not_bound(
    folder: Path, site: Site, value: str
) -> None:
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("needs:\n  surface: {is: volume}\n", SEEING))
    _, problems = elaborated(folder, bound(site, surface=value) if value else site)
    assert len(problems) == 1
    assert "needs `surface`" in problems[0]


def test_a_misspelt_volume_that_a_camera_must_see_is_named(folder: Path, site: Site) -> None:
    manifest = folder / "ecm.yaml"
    wrong = SEEING.replace("sees: surface", "sees: surfaces")
    manifest.write_text(manifest.read_text().replace("needs:\n  surface: {is: volume}\n", wrong))
    _, problems = elaborated(folder, bound(site, surface="tabletop"))
    assert len(problems) == 1
    assert "`surfaces` is neither a need of this module nor a volume" in problems[0]
    assert "did you mean `surface`?" in problems[0]


def test_a_camera_may_be_declared_before_the_volume_that_it_must_see(folder: Path, site: Site) -> None:
    manifest = folder / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("needs:\n  surface: {is: volume}\n", SEEING))
    cameras = {**site.cameras, "overhead": replace(site.cameras["overhead"], sees=frozenset({"tabletop"}))}
    eye, surface, *_ = settings(folder, bound(replace(site, cameras=cameras), surface="tabletop")).values()
    assert (eye.name, surface.name) == ("eye", "surface")
    assert (eye.value, eye.choices) == ("overhead", ("overhead",))


def test_a_sensor_may_be_asked_for_by_what_the_site_offers(folder: Path, site: Site, tmp_path: Path) -> None:
    manifest = folder / "ecm.yaml"
    needs = "needs:\n  survey: {is: sensor, offers: fixture_survey}\n"
    manifest.write_text(manifest.read_text().replace("needs:\n", needs))
    assert settings(folder, site)["survey"].choices == ()
    surveyed = tmp_path / "site.yaml"
    tape = "sensors:\n  tape: {description: places of fixtures, offers: [fixture_survey]}\n  ruler: lengths\n"
    surveyed.write_text(TABLE.read_text().replace("\nconstants:\n", f"\n{tape}\nconstants:\n", 1))
    found = load_site(surveyed, Diagnostics())
    assert found is not None
    assert found.sensors == {"tape": "places of fixtures", "ruler": "lengths"}
    assert settings(folder, found)["survey"].value == "tape"


CONSTANT = "  top: {is: constant, unit: m/s}\n"
WORDS = {
    CONSTANT: CONSTANT + "  rest: {is: action, parameters: [duration]}\n",
    "wait: duration <= pause and number < 3": "rest: duration <= 31 s",
}


def test_messages_use_the_words_of_the_manifest(folder: Path, site: Site) -> None:
    manifest = folder / "ecm.yaml"
    text = manifest.read_text()
    for old, new in WORDS.items():
        assert old in text
        text = text.replace(old, new)
    manifest.write_text(text)
    report = verify([folder], TABLE, settings=OperatorSettings(configurations={MODULE: BOUND}))
    texts = "\n".join(render_text(one) for subject in report.subjects for one in subject.diagnostics)
    assert "may ask for a `rest` that breaks the invariant `short-waits`" in texts
    assert "write `rest: " in texts
    assert "`wait" not in texts


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("wait: duration <= pause", "snooze: duration <= pause", "`snooze: {is: action}`"),
        ("sensors: [", "sensors: [feeler, ", "`feeler: {is: sensor}`, or `is: variable` or `is: camera`"),
        ("duration <= pause and", "vec(0 m, 0 m, 0 m) in garden and", "`garden: {is: volume}`"),
    ],
)
def test_a_name_that_is_no_need_is_proposed_as_one(
    folder: Path, site: Site, old: str, new: str, hint: str
) -> None:
    manifest = folder / "ecm.yaml"
    assert old in manifest.read_text()
    manifest.write_text(manifest.read_text().replace(old, new))
    report = verify([folder], TABLE, settings=OperatorSettings(configurations={MODULE: BOUND}))
    texts = "\n".join(render_text(one) for subject in report.subjects for one in subject.diagnostics)
    assert hint in texts


def test_a_default_reads_a_corner_of_the_volume_that_the_need_is_bound_to(folder: Path, site: Site) -> None:
    manifest = folder / "ecm.yaml"
    before, after = manifest.read_text().split("    outcomes:", 1)
    given = (
        "    inputs:\n      height: {type: real, unit: m, range: [0, 9], default: surface.upper.z - 5 mm}\n"
    )
    manifest.write_text(f"{before}{given}    outcomes:{after}")
    for volume in ("tabletop", "camera_mast"):
        ecm, _ = elaborated(folder, bound(site, surface=volume))
        assert ecm is not None
        (skill,) = [one for one in ecm.skills.values() if one.inputs]
        assert skill.inputs["height"].default_value == site.volumes[volume].upper[2] - Fraction(5, 1000)


def test_a_setting_says_if_the_site_file_or_the_operator_made_it(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    given = f"{MODULE}: {{bind: {{surface: tabletop}}, set: {{pause: 5 s, number: 1}}}}"
    path.write_text(f"schema: aeros/overlay/1\nbase: {TABLE}\nmodules:\n  {given}\n")
    site = load_site(path, Diagnostics())
    assert site is not None
    assert {name: one.source for name, one in settings(folder, site).items()} == {
        "surface": "site file", "top": "only choice", "pause": "site file", "number": "site file"
    }  # fmt: skip
    site = site.with_configurations(
        {MODULE: ModuleConfiguration({"surface": "camera_mast"}, {"pause": "6 s"})}
    )
    assert {name: one.source for name, one in settings(folder, site).items()} == {
        "surface": "set", "top": "only choice", "pause": "set", "number": "site file"
    }  # fmt: skip


def test_a_sensor_without_permission_is_proposed_as_a_need(folder: Path) -> None:
    manifest = folder / "ecm.yaml"
    text = manifest.read_text()
    assert "wait: duration <= pause" in text
    manifest.write_text(
        text.replace("wait: duration <= pause", "wait: not person_near and duration <= pause")
    )
    report = verify([folder], TABLE, settings=OperatorSettings(configurations={MODULE: BOUND}))
    texts = "\n".join(render_text(one) for subject in report.subjects for one in subject.diagnostics)
    assert "declare it under `needs`, too: `scanner: {is: sensor}`" in texts


@pytest.mark.parametrize(
    ("given", "code", "marked", "place"),
    [
        ("bind: {surface: tabletop}, set: {pause: 30 s}", "AE111", "30 s", "overlay.yaml"),
        ("bind: {surface: tabletop}, set: {pause: long}", "AE202", "long", "overlay.yaml"),
        ('bind: {surface: tabletop}, set: {pause: "long"}', "AE202", "long", "overlay.yaml:4"),
        ("bind: {surface: tabletop}, set: {paus: 3 s}", "AE122", "3 s", "overlay.yaml"),
        ("bind: {surface: slow}", "AE136", "slow", "overlay.yaml"),
    ],
)
def test_a_setting_of_a_site_file_is_at_fault_where_it_is_written(
    folder: Path, tmp_path: Path, given: str, code: str, marked: str, place: str
) -> None:
    path = tmp_path / "overlay.yaml"
    path.write_text(f"schema: aeros/overlay/1\nbase: {TABLE}\nmodules:\n  {MODULE}: {{{given}}}\n")
    found = load_site(path, Diagnostics())
    assert found is not None
    sink = Diagnostics()
    assert load_ecm(folder, found, sink) is None
    labels = [one.primary for one in sink if one.code == code]
    assert [one.span.text for one in labels if one is not None] == [marked]
    assert labels[0] is not None
    assert labels[0].span.source.path.endswith(place)
