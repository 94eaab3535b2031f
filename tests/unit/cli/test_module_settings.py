"""`--bind` and `--set`: read, refused, and shown."""

from __future__ import annotations

import argparse

import pytest

from aeros.cli.module_settings import (
    add_module_settings,
    add_settings,
    module_configuration,
    module_configurations,
    print_open_settings,
    print_settings,
)
from aeros.exit_codes import UsageError
from aeros.spec.elaborate.module.settings import Setting
from aeros.spec.model.configured import ModuleConfiguration

SETTINGS = (
    Setting("surface", "bench", ("bench", "table"), False, "set", "a volume"),
    Setting("eye", "", ("top", "side"), False, "", "a camera"),
    Setting("go", "move", ("move",), False, "only choice", "an action kind"),
    Setting("arm", "arm", ("arm", "leg"), False, "same name", "an actuator"),
    Setting("foot", "", (), False, "", "what it stands on"),
    Setting("force", "6 N", (), True, "set", "on the surface", "1 to 8 N"),
    Setting("pause", "2 s", (), True, "default", "", "1 to 8 s"),
    Setting("count", "", (), True, "default", "", "int"),
)


def parsed(*given: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_module_settings(parser)
    return parser.parse_args(given)


def test_each_module_has_its_settings() -> None:
    arguments = parsed("--bind", "a.surface=bench", "--set", "b.force = 6 N ", "--bind", "b.eye=top")
    assert module_configurations(arguments) == {
        "a": ModuleConfiguration({"surface": "bench"}),
        "b": ModuleConfiguration({"eye": "top"}, {"force": "6 N"}),
    }
    assert module_configurations(parsed()) == {}


@pytest.mark.parametrize(
    "given",
    [
        ("--bind", "surface"),
        ("--bind", "a.surface="),
        ("--bind", "=bench"),
        ("--bind", "a.b.c=d"),
        ("--bind", "a.surface=two words"),
        ("--bind", "a.Surface=bench"),
        ("--set", "a.force"),
        ("--set", "a.force=\n"),
        ("--set", "a.force=1\x1b[2J"),
        ("--set", "a.force=" + "9" * 300),
    ],
)
def test_malformed_settings_are_refused(given: tuple[str, str]) -> None:
    with pytest.raises(argparse.ArgumentError):
        parsed(*given)


@pytest.mark.parametrize("given", [("--bind", "surface=bench"), ("--set", "force=6.5 N")])
def test_a_setting_without_its_module_is_refused_with_an_example(given: tuple[str, str]) -> None:
    with pytest.raises(UsageError, match=rf"{given[0]} {given[1]}: .*as in `clean_pot.{given[1]}`"):
        module_configurations(parsed(*given))


def test_one_modules_settings_need_no_module() -> None:
    parser = argparse.ArgumentParser()
    add_settings(parser, "NEED", "NAME")
    arguments = parser.parse_args(["--bind", "surface=bench", "--set", "force=1 + 2 N"])
    assert module_configuration(arguments.bind, arguments.set) == ModuleConfiguration(
        {"surface": "bench"}, {"force": "1 + 2 N"}
    )


def test_every_setting_is_shown_with_its_reason(capsys: pytest.CaptureFixture[str]) -> None:
    print_settings(SETTINGS)
    assert capsys.readouterr().out.splitlines() == [
        "  surface  = bench  set; also possible: table (a volume)",
        "  eye      = ?      open: top, side (a camera)",
        "  go       = move   the only one here that suits (an action kind)",
        "  arm      = arm    of the same name; also possible: leg (an actuator)",
        "  foot     = ?      open (what it stands on)",
        "  force    = 6 N    set; 1 to 8 N (on the surface)",
        "  pause    = 2 s    default; 1 to 8 s",
        "  count    = ?      open; int",
    ]


def test_open_settings_are_shown_with_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    print_open_settings("tidy", SETTINGS)
    assert (
        capsys.readouterr().out.splitlines()[-1].endswith("aeros configure tidy --bind eye=top --set count=…")
    )
    print_open_settings("tidy", SETTINGS[:1])
    assert capsys.readouterr().out == ""
