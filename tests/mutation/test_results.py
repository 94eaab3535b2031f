"""Mutation of the kernel: its list of code and tests, and the results that the repository holds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from tests.mutation.areas import Area, near_tests, read_areas
from tests.mutation.results import (
    KILLED,
    LATE,
    SURVIVED,
    AreaResults,
    Outcome,
    Summary,
    argued,
    summarise,
    summary_table,
)
from tests.repo.tree import ROOT, UPDATE, text_of

_AREAS = read_areas()

KERNEL = (
    "aeros/runtime/gate/*.py",
    "aeros/runtime/gate/compiled/*.py",
    "aeros/runtime/monitor/*.py",
    "aeros/runtime/motion/*.py",
    "aeros/runtime/execution/*.py",
    "aeros/runtime/audit/*.py",
    "aeros/spec/obligations/**/*.py",
    "aeros/spec/expr/semantics.py",
    "aeros/spec/expr/lower.py",
    "aeros/spec/backends/**/*.py",
)
"""Code that decides, proves or keeps the record, all of which has to be in an area."""


_GENERATED = re.compile(r"(<!-- generated: results -->\n\n).*?(\n<!-- end: results -->)", re.DOTALL)


@pytest.mark.parametrize("area", _AREAS.values(), ids=_AREAS)
def test_an_area_lists_code_and_tests_that_exist(area: Area) -> None:
    for pattern in area.code:
        assert list(ROOT.glob(pattern)), pattern
    for path in (*area.tests, *area.whole):
        assert (ROOT / path).exists(), path


def test_all_of_the_kernel_is_in_one_area_and_no_file_in_two() -> None:
    files = [name for area in _AREAS.values() for name in area.files()]
    assert len(files) == len(set(files))
    kernel = {path.relative_to(ROOT).as_posix() for pattern in KERNEL for path in ROOT.glob(pattern)}
    assert {name for name in kernel if not name.endswith("__init__.py")} - set(files) == set()


def test_near_tests_are_the_mirrors_those_of_the_whole_and_those_of_the_folder() -> None:
    near = near_tests(_AREAS["cli"], ["aeros.cli.records.why"])
    assert "tests/unit/cli/records/test_why.py" in near
    assert {*_AREAS["cli"].whole} <= {*near}
    assert {path.as_posix() for path in Path("tests/unit/cli/records").glob("test_*.py")} <= {*near}
    assert "tests/unit/cli/robot/test_memory.py" not in near


@pytest.mark.parametrize("area", _AREAS.values(), ids=_AREAS)
def test_results_are_of_modules_of_their_area(area: Area) -> None:
    units = {key[0].partition(":")[0] for key in AreaResults(area.name).totals}
    assert units - set(area.modules()) == set()


def test_every_argument_is_about_a_mutant_that_no_test_killed() -> None:
    outcomes = {
        (key, number): outcome.verdict
        for name in _AREAS
        for key, one in AreaResults(name).of.items()
        for number, outcome in one.items()
    }
    wanted = {"equivalent": SURVIVED, "endless": LATE}
    for mutant, (kind, argument) in argued().items():
        assert outcomes.get(mutant) == wanted[kind], mutant
        assert len(argument.split()) > 3, mutant


def test_the_page_has_the_sums_of_the_results() -> None:
    page = text_of("docs/mutation.md")
    table, _ = summary_table([*_AREAS.values()])
    wanted, places = _GENERATED.subn(lambda found: found[1] + table + found[2], page)
    assert places == 1
    if UPDATE:
        (ROOT / "docs/mutation.md").write_text(wanted, encoding="utf-8")
    assert page == wanted, "renew docs/mutation.md with AEROS_UPDATE_GOLDEN=1"


def test_a_slice_of_every_area_is_tried_each_night() -> None:
    nightly = yaml.safe_load(text_of(".github/workflows/nightly.yml"))
    assert nightly["jobs"]["mutation"]["strategy"]["matrix"]["area"] == list(_AREAS)


def test_equal_results_are_written_as_equal_text(tmp_path: Path) -> None:
    results = AreaResults("none")
    results.path = tmp_path / "none.csv"
    results.keep({("aeros.a:b", "0123"): 12, ("aeros.a:c", "4567"): 1})
    for number in (1, 2, 3, 7):
        results.of["aeros.a:b", "0123"][number] = Outcome(KILLED, "test_b", 0.25)
    results.of["aeros.a:b", "0123"][5] = Outcome(SURVIVED, "", 2.0)
    results.write()
    assert results.path.read_text("utf-8").splitlines()[1:] == [
        "aeros.a:b,0123,12,killed,test_b,1-3 7,1.0",
        "aeros.a:b,0123,12,survived,,5,2.0",
        "aeros.a:c,4567,1,untried,,,0.0",
    ]
    summary = summarise(results)
    assert (summary.mutants, summary.tried, summary.killed, summary.survived) == (13, 5, 4, 1)
    assert not summary.holds(80.1)
    assert summary.holds(80.0)


def test_results_of_changed_code_are_dropped() -> None:
    results = AreaResults("none")
    results.of["aeros.a:b", "0123"][1] = Outcome(KILLED, "test_b", 0.25)
    results.keep({("aeros.a:b", "89ab"): 1})
    assert summarise(results) == Summary(1, 0, 0, 0)
