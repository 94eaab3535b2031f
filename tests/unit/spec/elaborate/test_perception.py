"""Perception of a module and of a site: variables, perceivers, cameras, and what is shared."""

from __future__ import annotations

import shutil
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import PictureRequest, SiteCamera
from aeros.spec.model.site import Site
from tests.unit.spec.faults import CORPUS, TABLE, messages_of_module, messages_of_site

OWN = "measures_its_own_predicate"


def site() -> Site:
    found = load_site(TABLE, Diagnostics())
    assert found is not None
    return found


def module(case: str = OWN) -> Ecm:
    found = load_ecm(CORPUS / "accepted" / case, site(), Diagnostics())
    assert found is not None
    return found.ecm


def test_variables_have_the_full_name_and_the_perceiver_that_provides_them() -> None:
    state = module().state
    assert list(state) == [f"{OWN}.clean", f"{OWN}.level"]
    level = state[f"{OWN}.level"]
    assert level.name == f"{OWN}.level"
    assert level.sensor == f"{OWN}.watch"
    assert level.range == (Fraction(0), Fraction(1, 10))
    assert level.max_age == 1
    assert level.uncertainty == Fraction(1, 1000)
    assert state[f"{OWN}.clean"].uncertainty is None


def test_a_perceiver_is_read_in_si() -> None:
    (perceiver,) = module().perceivers.values()
    assert perceiver.id == "watch"
    assert (perceiver.module_name, perceiver.function) == ("perceivers", "see")
    assert perceiver.pictures == (PictureRequest("overhead", 320, 240, depth=False),)
    assert perceiver.readings == ("hand",)
    assert perceiver.provides == (f"{OWN}.clean", f"{OWN}.level")
    assert perceiver.rate == 20
    assert perceiver.timeout == Fraction(1, 5)
    assert perceiver.memory == 256 * 2**20


def test_a_perceiver_names_its_models_each_of_which_is_a_file(tmp_path: Path) -> None:
    case = "models_with_an_interface"
    (perceiver,) = module(case).perceivers.values()
    assert perceiver.models == ("tent",)
    assert messages_of_module(tmp_path, ("models: [tent]", "models: [tnet]"), case=case) == [
        "error[AE122] unknown-reference: `tnet` is not a model of this module"
    ]


def test_a_perceiver_gets_parameters_in_si_by_their_names(tmp_path: Path) -> None:
    shutil.copytree(CORPUS / "accepted" / OWN, tmp_path / OWN)
    manifest = tmp_path / OWN / "ecm.yaml"
    given = """
parameters:
  full: {type: real, unit: mm, range: [1, 90], default: 60 mm}
  rows: {type: int, range: [1, 3], default: "2"}

perceivers:
"""
    text = manifest.read_text().replace("\nperceivers:\n", given)
    manifest.write_text(text.replace("readings: [hand]", "readings: [full, hand, rows]"))
    sink = Diagnostics()
    found = load_ecm(tmp_path / OWN, site(), sink)
    assert found is not None, list(sink)
    (perceiver,) = found.ecm.perceivers.values()
    assert perceiver.readings == ("hand",)
    assert perceiver.constants == {"full": 0.06, "rows": 2.0}


def test_conditions_hold_full_names_whichever_are_written() -> None:
    ecm = module()
    assert ecm.skills["tidy"].precondition is not None
    assert t.variables_of(ecm.skills["tidy"].precondition.term).keys() == {f"{OWN}.clean"}
    assert f"{OWN}.level" in t.variables_of(ecm.skills["tidy"].envelope["approach"].term)
    assert ecm.tasks["tidy_up"].initial == {"table_tidy": False, f"{OWN}.clean": True}


def test_a_site_declares_cameras_and_what_it_shares() -> None:
    one = site()
    assert one.cameras["overhead"] == SiteCamera("camera", 640, 480)
    shared = one.perception.shared["shared_with_another_range.water"]
    assert shared.range == (Fraction(0), Fraction(2))
    assert shared.uncertainty == Fraction(5, 1000)
    assert one.perception.in_invariants == frozenset()
    assert (one.perception.timeout, one.perception.memory) == (Fraction(1, 2), 512 * 2**20)


def test_a_site_caps_the_rate_of_perceivers(tmp_path: Path) -> None:
    assert messages_of_site(tmp_path, ("timeout: 500 ms", "timeout: 500 ms\n    rate: 19 Hz")) == []
    capped = load_site(tmp_path / "site.yaml", Diagnostics())
    assert capped is not None
    problems = Diagnostics()
    assert load_ecm(CORPUS / "accepted" / OWN, capped, problems) is None
    assert [one.headline for one in problems] == ["a perceiver's rate is above 0 Hz and at most 19 Hz"]
    (message,) = messages_of_site(tmp_path, ("timeout: 500 ms", "timeout: 500 ms\n    rate: 1001 Hz"))
    assert "a rate is above 0 Hz and at most 1000 Hz" in message


def test_a_shared_variable_is_read_by_modules_that_require_its_module() -> None:
    reader = module("reads_what_another_shares/reader")
    assert reader.state == {}
    condition = reader.skills["tidy"].precondition
    assert condition is not None
    assert t.variables_of(condition.term).keys() == {"gauge.dial_green"}


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("rate: 20 Hz", "rate: 2 kg"), "expected a value in 1/s, found kg"),
        (("rate: 20 Hz", "rate: 1001 Hz"), "a perceiver's rate is above 0 Hz and at most 1000 Hz"),
        (("memory: 256 MiB", "memory: 513 MiB"), "this site allows a perceiver at most 512 MiB"),
        (("memory: 256 MiB", "memory: much"), "`much` is not an amount of memory"),
        (
            ("memory: 256 MiB", "memory: 256 MiB\n    processor: 101 %"),
            "a processor share is at least 1 % and at most 100 % here",
        ),
        (("timeout: 200 ms", "timeout: 0 s"), "a perceiver's timeout is above 0 s and at most 0.5 s"),
        (("readings: [hand]", "readings: [hnad]"), "`hnad` is not a state variable that it may read"),
        (("readings: [hand]", "readings: [gauge.dial_green]"), "is not a state variable that it may read"),
        (("provides: [clean, level]", "provides: [clean, level, dry]"), "`dry` is not a state variable of"),
        (("uncertainty: 1 mm", "uncertainty: 0 mm"), "`uncertainty` must be above 0"),
        (("uncertainty: 1 mm", "uncertainty: 1 s"), "expected a value in m, found s"),
        (
            ("clean: {type: bool, max_age: 1 s}", "clean: {type: bool, max_age: 1 s, uncertainty: 1 mm}"),
            "a bool has no uncertainty",
        ),
        (("clean: {type: bool, max_age: 1 s}", "clean: {type: bool, max_age: 0 s}"), "`max_age` must be"),
    ],
)
def test_a_fault_of_perception_is_reported(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    found = messages_of_module(tmp_path, edit, case=OWN)
    assert message in found[0]


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("    timeout: 500 ms\n", "    timeout: 61 s\n"), "a timeout must be above 0 s and at most 60 s"),
        (("memory: 512 MiB", "memory: 1 TiB"), "`1 TiB` is not an amount of memory"),
        (
            ("memory: 512 MiB", "memory: 512 MiB\n    processor: 0 %"),
            "a processor share is at least 1 % and at most 100 % here",
        ),
        (("  underneath: {sensor", "  beside: {sensor"), "`beside` is not a member of the enum `cameras`"),
        (("gauge.dial_green: {type: bool", "gauge.dial_green: {type: boole"), "`boole` is not a type"),
    ],
)
def test_a_fault_of_a_sites_perception_is_reported(
    tmp_path: Path, edit: tuple[str, str], message: str
) -> None:
    (found,) = messages_of_site(tmp_path, edit)
    assert message in found


@pytest.mark.parametrize(
    ("edit", "difference"),
    [
        (("max_age: 1 s}", "max_age: 2 s}"), "`max_age: 1 s`"),
        (("type: bool, max_age: 1 s", "type: int, range: [0, 1], max_age: 1 s"), "the type bool"),
    ],
)
def test_a_module_declares_what_is_shared_as_the_site_does(
    tmp_path: Path, edit: tuple[str, str], difference: str
) -> None:
    found = messages_of_module(tmp_path, edit, case="reads_what_another_shares/gauge")
    assert any(
        f"`dial_green` is declared with {difference} where this site shares it" in one for one in found
    )


def test_a_shared_variable_must_be_declared_by_its_module(tmp_path: Path) -> None:
    edits = [("dial_green: {type", "dial_red: {type"), ("[dial_green]", "[dial_red]")]
    edits += [("precondition: dial_green", "precondition: dial_red")]
    (found,) = messages_of_module(tmp_path, *edits, case="reads_what_another_shares/gauge")
    assert "the site shares `gauge.dial_green`, which `gauge` does not declare" in found


def test_names_that_would_have_two_meanings_are_refused(tmp_path: Path) -> None:
    (found,) = messages_of_module(
        tmp_path, ("id: gauge\n", "id: hand\n"), case="reads_what_another_shares/gauge"
    )
    assert "`hand` is already a state variable of this site" in found
    edits = [("  dial_green: {type", "  gauge: {type"), ("provides: [dial_green]", "provides: [gauge]")]
    edits += [("precondition: dial_green", "precondition: gauge")]
    # The site shares what the module no longer declares, so there is a second message of another file.
    messages = messages_of_module(tmp_path / "again", *edits, case="reads_what_another_shares/gauge")
    assert any("`gauge` is already the name of this module" in message for message in messages)


PLACED = "cup: {{type: vec3, unit: m, range: [-1, 1], max_age: 1 s, uncertainty: 1 mm{more}}}"
LEVEL = "  level: {type: real, unit: mm, range: [0, 100], max_age: 1 s, uncertainty: 1 mm"


def _with_cup(more: str) -> tuple[tuple[str, str], ...]:
    return (
        (LEVEL, f"  {PLACED.format(more=more)}\n{LEVEL}"),
        ("provides: [clean, level]", "provides: [clean, level, cup]"),
    )


def test_a_position_may_have_the_space_of_the_thing_there(tmp_path: Path) -> None:
    shutil.copytree(CORPUS / "accepted" / OWN, tmp_path / OWN)
    manifest = tmp_path / OWN / "ecm.yaml"
    text = manifest.read_text()
    for old, new in _with_cup(", occupies: {lower: [-3 cm, -3 cm, -5 cm], upper: [3 cm, 3 cm, 50 mm]}"):
        text = text.replace(old, new)
    manifest.write_text(text)
    found = load_ecm(tmp_path / OWN, site(), Diagnostics())
    assert found is not None
    box = found.ecm.state[f"{OWN}.cup"].occupies
    assert box is not None
    assert box.upper == (Fraction(3, 100), Fraction(3, 100), Fraction(1, 20))
    assert found.ecm.state[f"{OWN}.level"].occupies is None


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (", occupies: {lower: [0 cm, 0 cm], upper: [1 cm, 1 cm, 1 cm]}", "`lower` has three lengths"),
        (
            ", occupies: {lower: [0 cm, 0 cm, 1 cm], upper: [1 cm, 1 cm, 1 cm]}",
            "`lower` is below `upper` along every axis",
        ),
        (", occupies: {lower: [0 s, 0 cm, 0 cm], upper: [1 cm, 1 cm, 1 cm]}", ""),
    ],
)
def test_a_space_with_a_fault_is_refused(more: str, message: str, tmp_path: Path) -> None:
    found = messages_of_module(tmp_path, *_with_cup(more), case=OWN)
    assert len(found) == 1
    assert message in found[0]


def test_only_a_position_has_a_space(tmp_path: Path) -> None:
    space = ", occupies: {lower: [0 cm, 0 cm, 0 cm], upper: [1 cm, 1 cm, 1 cm]}"
    (found,) = messages_of_module(tmp_path, (LEVEL, LEVEL + space), case=OWN)
    assert "only a position" in found
