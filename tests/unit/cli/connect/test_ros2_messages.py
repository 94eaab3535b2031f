"""`aeros ros2-messages` copies the wheels that it has built, or says why it cannot build them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.apps.ros2.message_build import MessageBuildError
from aeros.cli.connect import ros2_messages
from aeros.cli.main import main
from aeros.exit_codes import Exit


def test_the_wheels_are_copied_into_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wheel = tmp_path / "cache" / "aeros_msgs-1.0.0.whl"
    wheel.parent.mkdir()
    wheel.write_text("wheel")
    monkeypatch.setattr(ros2_messages, "build_messages", lambda cache, report: [wheel])
    assert main(["ros2-messages", "--out", str(tmp_path / "out")]) == Exit.SUCCESS
    assert (tmp_path / "out" / wheel.name).read_text() == "wheel"
    assert str(tmp_path / "out" / wheel.name) in capsys.readouterr().out


def test_a_build_that_fails_is_explained(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(cache: Path, report: Callable[[str], None]) -> list[Path]:
        raise MessageBuildError("`ninja` is needed: install cmake, ninja-build and g++")

    monkeypatch.setattr(ros2_messages, "build_messages", fail)
    assert main(["ros2-messages"]) == Exit.REJECTED
    assert "aeros: `ninja` is needed" in capsys.readouterr().err
