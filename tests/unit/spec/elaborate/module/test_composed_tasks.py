"""A task that composes tasks of required modules takes over their scenes and typical starts."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.elaborate.module.composed_tasks import composed_tasks
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.text.discovery import Surroundings, reference_site_path
from tests.shipped_scenes import ECMS

END_DAY = Path(__file__).parent / "end_day"


@cache
def end_day() -> Ecm:
    """A module without skills that composes two shipped ones."""
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    assert site is not None
    shipped = (ECMS / "clean_table", ECMS / "make_dumplings")
    loaded = load_ecm(END_DAY, site, diagnostics, Surroundings((END_DAY, *shipped)))
    assert loaded is not None, [one.headline for one in diagnostics]
    return loaded.ecm


def task() -> Task:
    return end_day().tasks["end_day"]


def test_the_tasks_of_the_modules_that_are_called_are_composed_in_the_order_of_the_rules() -> None:
    assert list(task().composed) == ["make_dumplings", "clean_table"]
    assert [(module, one.scene) for module, one in task().rehearsals("end_day")] == [
        ("make_dumplings", "dumpling_bench"),
        ("clean_table", "table"),
    ]
    assert replace(task(), scene="own").rehearsals("end_day") == (("end_day", replace(task(), scene="own")),)


def test_of_several_tasks_the_one_is_composed_whose_goal_reads_most_of_the_goal() -> None:
    ecm = end_day()
    table = ecm.foreign.modules["clean_table"]
    (own,) = table.tasks.values()
    other = replace(own, id="other", goal=ecm.foreign.modules["make_dumplings"].tasks["make_dumplings"].goal)
    bare = replace(table, tasks={"other": other, "clean_table": own})
    modules = {**ecm.foreign.modules, "clean_table": bare}
    found = composed_tasks(replace(ecm, foreign=replace(ecm.foreign, modules=modules)), task())
    assert found["clean_table"] == own
    none = {**ecm.foreign.modules, "clean_table": replace(table, tasks={})}
    left = composed_tasks(replace(ecm, foreign=replace(ecm.foreign, modules=none)), task())
    assert list(left) == ["make_dumplings"]


def test_the_start_has_what_the_task_says_then_what_the_first_composed_task_says() -> None:
    start, modules = task().start, end_day().foreign.modules
    bench = modules["make_dumplings"].tasks["make_dumplings"].initial
    assert start["clean_table.robot_at_table"] is False
    assert start["base_position"] == bench["base_position"]
    assert (
        start["clean_table.bin_position"]
        == modules["clean_table"].tasks["clean_table"].initial["clean_table.bin_position"]
    )
    assert set(task().initial) == {"clean_table.robot_at_table"}  # proofs start from any other state


def test_a_task_that_composes_a_composing_task_has_all_that_this_one_has() -> None:
    outer = replace(task(), initial={}, composed={"end_day": task()})
    assert outer.start == task().start
    assert outer.rehearsals("outer") == task().rehearsals("end_day")


@pytest.mark.parametrize(
    ("place", "hidden"),
    [
        ("      clean_table.robot_at_table: false\n", "      make_dumplings.press_free: false\n"),
        ("    initial:", "    report: [make_dumplings.press_free]\n"),
    ],
)
def test_a_variable_that_is_not_public_is_refused_as_such(tmp_path: Path, place: str, hidden: str) -> None:
    manifest = (END_DAY / "ecm.yaml").read_text()
    assert place in manifest
    (folder := tmp_path / "end_day").mkdir()
    (folder / "ecm.yaml").write_text(manifest.replace(place, hidden + place))
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    assert site is not None
    around = Surroundings((folder, ECMS / "clean_table", ECMS / "make_dumplings"))
    assert load_ecm(folder, site, diagnostics, around) is None
    (found,) = diagnostics
    assert found.code == "AE122"
    assert found.headline == (
        "`make_dumplings.press_free` is a state variable of `make_dumplings` that is not public"
    )
    assert found.primary is not None
    assert found.primary.span.text == "make_dumplings.press_free"
    (public,) = (one for one in found.help if one.startswith("public are: "))
    assert "robot_at_bench" in public
    assert "press_free" not in public
