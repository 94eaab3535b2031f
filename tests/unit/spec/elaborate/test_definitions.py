"""Definitions of modules with their margins, and those of a site, which modules adopt."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.verification.verify import verify
from tests.unit.spec.faults import CORPUS, loaded_module

MODULE = CORPUS / "accepted" / "things_of_two_kinds"
STATE = "state:\n"


def loaded(variable: str, folder: Path) -> tuple[Ecm | None, list[tuple[str, str]]]:
    """Load the module with one more variable, which stands below the others."""
    shutil.copytree(MODULE, folder / MODULE.name)
    text = (MODULE / "ecm.yaml").read_text()
    assert text.count("\nthings:\n") == 1
    (folder / MODULE.name / "ecm.yaml").write_text(text.replace("\nthings:\n", f"  {variable}\n\nthings:\n"))
    return loaded_module(folder / MODULE.name)


@pytest.mark.parametrize(
    ("margin", "number"), [("", 0), (", margin: 2", 2), (", margin: 0.5", Fraction(1, 2))]
)
def test_the_margin_is_a_number_of_standard_uncertainties(
    margin: str, number: Fraction, tmp_path: Path
) -> None:
    ecm, problems = loaded(
        f"full: {{type: bool, max_age: 1 s, definition: level >= 50 mm{margin}}}", tmp_path
    )
    assert problems == []
    assert ecm is not None
    assert ecm.definitions["things_of_two_kinds.full"].margin == number


@pytest.mark.parametrize(
    ("variable", "code", "words"),
    [
        ("full: {type: bool, max_age: 1 s, margin: 2}", "AE120", "no definition"),
        ("full: {type: bool, max_age: 1 s, definition: clean, margin: 2}", "AE112", "changes nothing"),
        (
            "full: {type: bool, max_age: 1 s, definition: level >= 1 mm, margin: -1}",
            "AE111",
            "outside its bounds",
        ),
        ("full: {type: int, range: [0, 1], max_age: 1 s, definition: clean}", "AE203", "only a `bool`"),
        ("full: {type: bool, max_age: 1 s, definition: full}", "AE202", "full"),
    ],
)
def test_each_fault_of_a_definition_is_reported(variable: str, code: str, words: str, tmp_path: Path) -> None:
    ecm, problems = loaded(variable, tmp_path)
    assert ecm is None
    assert code in [one for one, headline in problems if words in headline], problems


SITE = CORPUS / "accepted" / "site_that_defines_predicates" / "site.yaml"
ADOPTING = Path(__file__).parent / "adopts_definitions"


def adopting_module(folder: Path, site_file: Path = SITE, **edits: str) -> tuple[Ecm | None, list[str], Site]:
    """Load the module that uses the definitions of the site, with parts of its manifest replaced."""
    shutil.copytree(ADOPTING, folder / ADOPTING.name)
    manifest = folder / ADOPTING.name / "ecm.yaml"
    text = manifest.read_text()
    for old, new in edits.items():
        assert f"{old}: " in text
        text = re.sub(rf"\b{old}: .*", f"{old}: {new}", text)
    manifest.write_text(text)
    sink = Diagnostics()
    site = load_site(site_file, sink)
    assert site is not None
    found = load_ecm(folder / ADOPTING.name, site, sink)
    return None if found is None else found.ecm, [one.headline for one in sink], site


def conclusions(module: Path) -> tuple[str, list[str]]:
    """Verify a module; return the conclusion and the codes of what is reported of it."""
    (found,) = verify([module], SITE).modules
    return found.conclusion.value, [one.code for one in found.diagnostics]


def test_a_module_has_a_predicate_of_its_own_for_each_definition_of_the_site_that_it_uses(
    tmp_path: Path,
) -> None:
    ecm, problems, site = adopting_module(tmp_path)
    assert problems == []
    assert ecm is not None
    assert ecm.definitions == {"adopts_definitions.work_is_open": site.definitions["work_is_open"]}
    predicate = ecm.state["adopts_definitions.work_is_open"]
    assert predicate.max_age == Fraction(1, 10)  # that of what it reads
    goal, start = ecm.tasks["wait_for_work"].goal, ecm.skills["ask"].precondition
    assert start is not None
    for term in (goal, start.term):
        assert t.variables_of(term).keys() == {predicate.name}


def test_at_every_tick_a_definition_stands_for_its_condition(tmp_path: Path) -> None:
    ecm, problems, _ = adopting_module(tmp_path)
    assert problems == []
    assert ecm is not None
    skill = ecm.skills["ask"]
    assert skill.hold_condition is not None
    for term in (skill.envelope["move"].term, skill.hold_condition.term):
        assert t.variables_of(term).keys() >= {"lamp_on", "person_distance"}


def test_an_envelope_within_a_definition_keeps_the_invariant_that_uses_it(tmp_path: Path) -> None:
    adopting_module(tmp_path)
    assert conclusions(tmp_path / ADOPTING.name) == ("proved", [])


def test_an_envelope_beyond_a_definition_breaks_the_invariant_that_uses_it(tmp_path: Path) -> None:
    adopting_module(tmp_path, move="speed <= 0.21 m/s")
    assert conclusions(tmp_path / ADOPTING.name) == ("rejected", ["AE501"])


def test_a_module_needs_permission_for_what_a_definition_reads(tmp_path: Path) -> None:
    adopting_module(tmp_path, sensors="[panel]")
    conclusion, codes = conclusions(tmp_path / ADOPTING.name)
    assert conclusion == "rejected"
    assert set(codes) == {"AE405"}


def test_a_definition_that_a_module_does_not_use_costs_it_no_permission(tmp_path: Path) -> None:
    unused = {"goal": "lamp_on", "unless": "lamp_on, do: ask}", "initial": "{lamp_on: false}"}
    unused |= {
        "precondition": "not lamp_on",
        "effects": "{lamp_on: true}}",
        "hold": "lamp_on",
        "move": "speed <= 0.2 m/s",
    }
    ecm, problems, _ = adopting_module(tmp_path, SITE, **unused)
    assert problems == []
    assert ecm is not None
    assert not ecm.definitions
    assert not ecm.state


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("person_distance", "expected bool, found real [m]"),
        ("person_is_near or lamp_on", "`person_is_near` is defined by itself"),
        ("work_is_open or lamp_on", "`person_is_near` uses `work_is_open`, which is not defined above it"),
        ("kettle.work_is_open", None),  # another module's, which has the name of a definition below
    ],
)
def test_a_faulty_definition_of_a_site_is_the_only_fault(
    condition: str, expected: str | None, tmp_path: Path
) -> None:
    text = SITE.read_text().replace("person_distance < 2 m", condition)
    shared = (
        "  perception: {shared: {kettle.work_is_open: {type: bool, max_age: 1 s, in_invariants: true}}}\n"
    )
    (tmp_path / "site.yaml").write_text(text + shared)
    sink = Diagnostics()
    load_site(tmp_path / "site.yaml", sink)
    assert [one.headline for one in sink] == ([] if expected is None else [expected])


def test_a_module_with_predicates_of_the_site_has_no_name_of_a_variable(tmp_path: Path) -> None:
    _, problems, _ = adopting_module(tmp_path, id="person_distance")
    assert problems == ["`person_distance` is already a state variable of this site"]


def test_a_site_shares_nothing_of_a_module_with_the_name_of_a_parameter(tmp_path: Path) -> None:
    shared = "  perception: {shared: {speed.x: {type: bool, max_age: 1 s}}}\n"
    (tmp_path / "site.yaml").write_text(SITE.read_text() + shared)
    sink = Diagnostics()
    load_site(tmp_path / "site.yaml", sink)
    assert [one.headline for one in sink] == ["`speed` is already a parameter of `move`"]


@pytest.mark.parametrize(
    ("effects", "codes"),
    [
        ("work_is_open: true, lamp_on: false", ["AE513"]),
        ("work_is_open: true, person_is_near: true", ["AE513", "AE513"]),  # each excludes the other
        ("work_is_open: true, lamp_on: true, person_is_near: false", []),
    ],
)
def test_an_outcome_declares_no_state_that_definitions_exclude(
    effects: str, codes: list[str], tmp_path: Path
) -> None:
    adopting_module(tmp_path, effects=f"{{{effects}}}}}")
    assert conclusions(tmp_path / ADOPTING.name) == ("rejected" if codes else "proved", codes)


def test_a_misspelt_definition_is_named(tmp_path: Path) -> None:
    _, problems, _ = adopting_module(tmp_path, goal="work_is_opne")
    assert problems == ["`work_is_opne` is not declared here"]


def test_a_definition_that_reads_what_the_module_may_not_read_says_so(tmp_path: Path) -> None:
    site = tmp_path / "site.yaml"
    text = SITE.read_text().replace(
        "person_is_near: person_distance < 2 m",
        "person_is_near: person_distance < 2 m\n  kettle_hot: kettle.hot",
    )
    shared = "  perception: {shared: {kettle.hot: {type: bool, max_age: 1 s}}}\n"
    site.write_text(text + shared)
    _, problems, _ = adopting_module(tmp_path, site, goal="kettle_hot")
    assert problems == ["`kettle_hot` reads `kettle.hot`, which cannot be read here"]


def test_a_definition_that_several_modules_use_is_known_by_its_name_alone(tmp_path: Path) -> None:
    ecm, _, site = adopting_module(tmp_path)
    assert ecm is not None
    (predicate,) = ecm.state.values()
    second = replace(predicate, variable=replace(predicate.variable, name="then_adopts.work_is_open"))
    both = site.with_modules([ecm, replace(ecm, state={second.name: second})])
    assert both.short_names == {"work_is_open": "adopts_definitions.work_is_open"}
