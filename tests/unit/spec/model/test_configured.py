"""Settings of modules: joined, written and read again."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType
from aeros.spec.model.configured import (
    UNCONFIGURED,
    BoundNames,
    ModuleConfiguration,
    site_names,
)
from aeros.spec.model.variables import Declared

SPAN = Source("ecm.yaml", "").span(0, 0)

_TEXTS = st.dictionaries(st.text(max_size=4), st.text(max_size=4), max_size=3)
CONFIGURATIONS = st.builds(ModuleConfiguration, _TEXTS, _TEXTS)


@given(CONFIGURATIONS)
def test_settings_are_read_as_they_were_written(one: ModuleConfiguration) -> None:
    assert ModuleConfiguration.from_json(one.to_json()) == one
    assert bool(one) == (one != UNCONFIGURED) == bool(one.to_json())


@given(CONFIGURATIONS, CONFIGURATIONS)
def test_later_settings_come_first_and_none_is_lost(
    old: ModuleConfiguration, new: ModuleConfiguration
) -> None:
    both = old.updated(new)
    assert both.bindings == {**old.bindings, **new.bindings}
    assert both.parameters == {**old.parameters, **new.parameters}


@pytest.mark.parametrize(
    "data", [None, [], {"bind": []}, {"bind": {"a": 1}}, {"set": {"a": None}}, {"bound": {}}]
)
def test_data_of_another_form_are_refused(data: Any) -> None:
    with pytest.raises(ValueError, match="setting"):
        ModuleConfiguration.from_json(data)


def test_settings_are_shown_in_one_order() -> None:
    assert str(ModuleConfiguration({"surface": "bench"}, {"force": "6 N"})) == "force=6 N, surface=bench"


def test_names_of_cameras_are_replaced_in_parameters_that_are_cameras() -> None:
    cameras = t.Variable("camera", EnumType("cameras", ("top", "side")), t.VariableRole.PARAMETER)
    flag = t.Variable("flag", BOOL, t.VariableRole.PARAMETER)
    declared = {"camera": Declared(cameras, SPAN), "flag": Declared(flag, SPAN)}
    names = BoundNames(cameras={"eye": "top"})
    given_ = {"camera": "eye", "flag": "eye", "strange": "eye"}
    assert names.site_values(given_, declared) == {"camera": "top", "flag": "eye", "strange": "eye"}
    assert names.site_values({"camera": "side"}, declared) == {"camera": "side"}


def test_a_name_that_is_no_need_stays() -> None:
    assert BoundNames({"eye": "top"}).site_name("eye") == "top"
    assert BoundNames({"eye": "top"}).site_name("side") == "side"
    assert site_names(("go", "arm"), {"go": ("arm", "wheels")}) == {"arm", "wheels"}
