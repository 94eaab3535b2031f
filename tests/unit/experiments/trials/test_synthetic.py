"""Synthetic modules: a number gives one module, whose skills have numbers of their own."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.experiments.trials.synthetic import SKILLS, _manifest, write_module, write_modules
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.text.discovery import reference_site_path
from tests.hypothesis_profiles import examples


def loaded(folder: Path) -> Ecm:
    sink = Diagnostics()
    site = load_site(reference_site_path(), sink)
    assert site is not None
    found = load_ecm(folder, site, sink)
    sink.raise_if_errors()
    assert found is not None
    return found.ecm


def test_modules_are_numbered_from_0(tmp_path: Path) -> None:
    folders = write_modules(tmp_path / "all", 3, skills=5)
    assert [folder.name for folder in folders] == ["module_0000", "module_0001", "module_0002"]
    assert all((folder / name).is_file() for folder in folders for name in ("ecm.yaml", "skills.py"))
    assert write_modules(tmp_path, 0) == []


@pytest.mark.parametrize(("number", "skills"), [(0, 10), (4, 5), (7, 7)])
def test_a_module_is_one_under_the_reference_site(tmp_path: Path, number: int, skills: int) -> None:
    ecm = loaded(write_module(tmp_path, number, skills=skills))
    assert ecm.id == f"module_{number:04}"
    assert list(ecm.skills) == [f"skill_{index}" for index in range(skills)]
    assert list(ecm.tasks) == ([f"task_{number:04}"] if number % 4 == 0 else [])
    with_inputs = [name for name, skill in ecm.skills.items() if skill.inputs]
    assert with_inputs == [f"skill_{index}" for index in range(2, skills, 3)]
    with_precondition = [name for name, skill in ecm.skills.items() if skill.precondition is not None]
    assert with_precondition == [f"skill_{index}" for index in range(1, skills, 2)]
    slides = [name for name, skill in ecm.skills.items() if "slide" in skill.envelope]
    assert slides == with_precondition


def test_one_module_in_ten_depends_on_the_one_before(tmp_path: Path) -> None:
    texts = {number: (write_module(tmp_path, number) / "ecm.yaml").read_text() for number in (8, 9, 19)}
    assert "  modules:\n" not in texts[8]
    assert "  modules:\n    module_0008: '>=1.0'\n" in texts[9]
    assert "  modules:\n    module_0018: '>=1.0'\n" in texts[19]


def test_a_task_reaches_for_what_its_two_skills_bring_about(tmp_path: Path) -> None:
    ecm = loaded(write_module(tmp_path, 4))
    task = ecm.tasks["task_0004"]
    assert [(rule.skill, rule.retry, rule.between_tries) for rule in task.rules] == [
        ("skill_0", 1, "skill_4"),
        ("skill_2", 0, None),
    ]
    brought = {name for rule in task.rules for name in ecm.skills[rule.skill].outcomes["done"].effects}
    assert set(task.initial) == brought == {"module_0004.open", "module_0004.narrow"}
    assert task.goal_text == "open and narrow"


def test_a_skill_asks_for_its_own_numbers() -> None:
    text = _manifest(3, "1.0.0", SKILLS)
    # the 31st skill of all: 100 + 31/100 mm/s, 5 + 31/2000 N, 40 + 31/500 mm
    part = text[text.index("  skill_1:") : text.index("  skill_2:")]
    assert "speed <= 100.310 mm/s" in part
    assert "grip: width <= 40.062 mm and force <= 5.01550 N" in part
    first = text[text.index("  skill_0:") : text.index("  skill_1:")]
    assert "wait: duration <= 1.0300 s" in first
    third = text[text.index("  skill_2:") : text.index("  skill_3:")]
    assert "range: [0, 0.100320]" in third
    assert "speed <= inputs.pace" in third


def test_of_the_second_thousand_the_numbers_lie_between_those_of_the_first() -> None:
    assert "duration <= 1.0005 s" in _manifest(1000, "1.0.0", SKILLS)
    assert "duration <= 10.9980 s" in _manifest(999, "1.0.0", SKILLS)


@examples(15)
@given(st.lists(st.integers(0, 1999), min_size=2, max_size=2, unique=True))
def test_no_two_skills_have_the_same_forces(numbers: list[int]) -> None:
    widths = [
        re.findall(r"force <= (\d\.\d{5}) N\n", _manifest(number, "1.0.0", SKILLS)) for number in numbers
    ]
    assert not set(widths[0]) & set(widths[1])


def test_another_version_is_another_text_of_the_same_skills(tmp_path: Path) -> None:
    before = loaded(write_module(tmp_path, 1))
    after = loaded(write_module(tmp_path, 1, version="1.1.0"))
    assert (before.version, after.version) == ("1.0.0", "1.1.0")
    assert before.skills.keys() == after.skills.keys()
