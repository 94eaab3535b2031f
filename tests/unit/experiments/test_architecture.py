"""Architectures by name: built in, or anybody's class, or the reason why there is none."""

from __future__ import annotations

import sys

import pytest

from aeros.experiments.architecture import (
    BUILT_IN,
    ArchitectureReport,
    CallLimitError,
    SelfPredicting,
    build_architecture,
    load_class,
)
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.experiments.support.entered import Stubborn


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_shipped_architecture_can_be_made(name: str) -> None:
    assert callable(load_class(name)().pursue)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("flatt", "there is no architecture `flatt`"),
        ("no.such:Thing", "No module named 'no'"),
        ("tests.unit.experiments.support.entered:Nothing", "Nothing"),
        ("tests.unit.experiments.support.entered:NoArchitecture", "has no method `pursue`"),
    ],
)
def test_an_object_that_is_no_architecture_is_refused(name: str, why: str) -> None:
    with pytest.raises(MisuseError, match=why):
        load_class(name)


def test_options_that_it_does_not_take_are_refused() -> None:
    with pytest.raises(MisuseError, match="does not take the options"):
        build_architecture("flat", {"tries": 3})


def test_the_names_in_findings_are_kept() -> None:
    report = ArchitectureReport(retries=1, recoveries=2, replans=3, reason="tired", planning_timeouts=4)
    assert report.findings() == {
        "retries": 1,
        "recoveries": 2,
        "replans": 3,
        "reason": "tired",
        "late": 4,
    }
    assert ArchitectureReport().findings() == {
        "retries": 0,
        "recoveries": 0,
        "replans": 0,
        "reason": "",
        "late": 0,
    }


def test_anybodys_class_is_loaded_and_gets_its_options() -> None:
    assert load_class("tests.unit.experiments.support.entered:Stubborn") is Stubborn
    made = build_architecture("tests.unit.experiments.support.entered:Stubborn", {"patience": 3})
    assert isinstance(made, Stubborn)
    assert made._patience == 3


def test_a_built_in_one_whose_library_is_missing_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "aeros.experiments.architectures.behaviour_tree", None)
    with pytest.raises(MisuseError, match=r"^`behaviour_tree` needs `pip install '\.\[experiments\]'`"):
        load_class("behaviour_tree")


@pytest.mark.parametrize("name", ["", "flat:", ":Flat", "no_colon_at_all"])
def test_a_name_of_another_form_is_refused_with_those_that_there_are(name: str) -> None:
    with pytest.raises(MisuseError, match=r"there are aeros, .*, progprompt, or name PACKAGE"):
        load_class(name)


def test_the_error_of_an_endless_architecture_counts_its_calls() -> None:
    assert str(CallLimitError()) == "stopped after 10000 calls without finishing"


def test_only_some_predict_themselves() -> None:
    assert isinstance(build_architecture("aeros", {}), SelfPredicting)
    assert not isinstance(build_architecture("flat", {}), SelfPredicting)
