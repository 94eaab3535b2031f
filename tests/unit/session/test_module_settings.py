"""Bindings and parameters as arguments of the public names: they say the same as `--bind` and `--set`."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import aeros
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.session.module_settings import read_module_settings
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.render import render_all
from aeros.spec.model.configured import ModuleConfiguration

MODULE = Path(__file__).with_name("data") / "hover_high"
AREA = {"hover_high.area": "bench_area"}


def test_settings_are_sorted_by_module() -> None:
    read = read_module_settings({"a.surface": "bench", "b.eye": "top"}, {"b.force": "6 N"})
    assert read.blocks == ()
    assert read.configurations == {
        "a": ModuleConfiguration({"surface": "bench"}),
        "b": ModuleConfiguration({"eye": "top"}, {"force": "6 N"}),
    }
    assert read_module_settings(None, None).configurations == {}


@pytest.mark.parametrize(
    ("bindings", "parameters", "text"),
    [
        (["a.surface=bench"], None, '`list`; give a dict, as in {"clean_pot.surface": "bench"}'),
        (None, "a.force=6 N", '`str`; give a dict, as in {"clean_pot.force": "6 N"}'),
        ({"surface": "bench"}, None, "begin with the module, as in `clean_pot.surface=bench`"),
        (None, {"force": "6 N"}, "begin with the module, as in `clean_pot.force=6 N`"),
        ({"a.surface": "two words"}, None, "`a.surface=two words` is not a setting, as in `surface=bench`"),
        ({"a.b.c": "d"}, None, "`a.b.c=d` is not a setting, as in `surface=bench`"),
        (None, {"a.force": " "}, "`a.force= ` is not a setting, as in `force=6 N`"),
        (None, {"a.force": "9" * 300}, "the value of `a.force` is not one line of at most 200 characters"),
        (None, {"a.force": 6}, "`parameters['a.force']` is an object of type `int`; give a str"),
        ({7: "bench"}, None, "`a name in bindings` is an object of type `int`; give a str"),
    ],
)  # fmt: skip
def test_settings_of_another_form_are_refused(bindings: Any, parameters: Any, text: str) -> None:
    with pytest.raises(MisuseError) as refused:
        read_module_settings(bindings, parameters)
    assert str(refused.value).endswith(text)
    assert ("bindings" if bindings else "parameters") in str(refused.value)


def test_a_session_runs_a_module_as_it_is_bound(tmp_path: Path) -> None:
    module = Path(shutil.copytree(MODULE, tmp_path / "hover_high"))
    height = {"hover_high.height": "0.4 m"}
    settings = ["--bind", "hover_high.area=bench_area", "--set", "hover_high.height=0.4 m"]
    assert main(["verify", str(module), *settings]) == Exit.SUCCESS
    for state in (None, tmp_path / "robot"):
        with aeros.open_session(module, bindings=AREA, parameters=height, state=state) as session:
            assert session.run("hover").reached
        # With other settings it is proved anew; the certificate is of the same files.
        with aeros.open_session(module, bindings=AREA, state=state) as session:
            assert session.run("hover").reached


MEASURED = {
    **dict.fromkeys(("joint_velocity", "joint_torque", "joint_torque_rate"), (0.0,) * 7),
    "joint_position": (0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0),
    **dict.fromkeys(("tool_speed", "link_speed", "tracking_error", "contact_force"), 0.0),
    **dict.fromkeys(("estop_pressed", "holding"), False),
    "human_distance": 20.0,
    "tool_position": (0.5, 0.0, 0.3),
    "base_position": (0.0, 0.0, 0.0),
}


def test_a_gate_decides_with_the_parameters_that_are_set() -> None:
    denied_by = {}
    for pace in ("0.06 m/s", "0.16 m/s"):
        gate = aeros.load_gate(MODULE, skill="rise", bindings=AREA, parameters={"hover_high.pace": pace})
        action = aeros.act("move_tool", target=(0.5, 0.0, 0.3), yaw=0.0, speed=0.1)
        decision = gate.decide(action, MEASURED, inputs={"height": 0.3, "pace": 0.06})
        denied_by[pace] = [one.rule for one in decision.reasons]
    assert denied_by == {"0.06 m/s": ["move_tool"], "0.16 m/s": []}


def of_verify(**settings: Any) -> str:
    return render_all(
        [one for subject in aeros.verify(MODULE, **settings).subjects for one in subject.diagnostics]
    )


def of_load_gate(**settings: Any) -> str:
    with pytest.raises(UserError) as refused:
        aeros.load_gate(MODULE, **settings)
    return str(refused.value)


def of_open_session(**settings: Any) -> str:
    with pytest.raises(UserError) as refused, aeros.open_session(MODULE, **settings):
        pass
    return str(refused.value)


@pytest.mark.parametrize("use", [of_verify, of_load_gate, of_open_session])
@pytest.mark.parametrize(
    ("bindings", "parameters"),
    [
        ({"hover_high.area": "bench"}, {}),
        ({"hover_high.are": "bench_area"}, {}),
        (AREA, {"hover_high.height": "2 m"}),
        (AREA, {"hover_high.height": "2 kg"}),
        (AREA, {"hover_high.heights": "0.3 m"}),
        ({}, {}),
    ],
)
def test_wrong_names_and_values_give_the_errors_of_the_command_line(
    use: Callable[..., str],
    bindings: dict[str, str],
    parameters: dict[str, str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    options = [f"--bind={name}={value}" for name, value in bindings.items()]
    options += [f"--set={name}={value}" for name, value in parameters.items()]
    assert main(["verify", str(MODULE), "--no-lock", *options]) == Exit.REJECTED
    shown = capsys.readouterr().out
    text = use(bindings=bindings, parameters=parameters)
    assert text.startswith("error[AE")
    assert text in shown
