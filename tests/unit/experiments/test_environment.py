"""The machine and releases of a run, as far as they can be found."""

from __future__ import annotations

import platform
import subprocess
from importlib.metadata import version
from typing import Any

import pytest

from aeros.experiments import environment as module
from aeros.experiments.environment import environment, package_versions


class Git:
    """A `git` with a given output for each command."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **message: Any) -> None:
        self.reported = message
        self.real = subprocess.run
        monkeypatch.setattr(subprocess, "run", self.run)

    def run(self, command: tuple[str, ...], **how: Any) -> Any:
        if command[0] != "git":
            return self.real(command, **how)
        name, folder = command[3], command[2]
        assert command[:2] == ("git", "-C")
        assert folder.endswith("aeros")
        assert how["check"]  # what fails is to be seen
        message = self.reported[name.replace("-", "_")]
        if isinstance(message, Exception):
            raise message
        return subprocess.CompletedProcess(command, 0, message)


def test_machine_and_releases_are_described(monkeypatch: pytest.MonkeyPatch) -> None:
    Git(monkeypatch, rev_parse="abc\n", status="")
    found = environment()
    assert found["commit"] == "abc"
    assert found["python"] == platform.python_version()
    assert found["platform"] == platform.platform()
    assert found["processors"] >= 1
    assert found["packages"]["z3-solver"] == version("z3-solver")


@pytest.mark.parametrize(
    ("message", "commit"),
    [
        ({"rev_parse": "abc\n", "status": ""}, "abc"),
        ({"rev_parse": "abc\n", "status": " M aeros/x.py\n"}, "abc+"),
        ({"rev_parse": subprocess.CalledProcessError(128, "git"), "status": ""}, None),
        ({"rev_parse": FileNotFoundError("git"), "status": ""}, None),
        ({"rev_parse": subprocess.TimeoutExpired("git", 10), "status": ""}, None),
    ],
)
def test_a_commit_is_marked_where_files_have_changed_and_none_without_a_checkout(
    message: dict[str, Any], commit: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    Git(monkeypatch, **message)
    assert environment()["commit"] == commit


def test_a_package_that_is_not_there_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    Git(monkeypatch, rev_parse="abc", status="")
    monkeypatch.setattr(module, "_PACKAGES", ("z3-solver", "no-such-package"))
    assert environment()["packages"].keys() == {"z3-solver"}


def test_releases_that_decide_findings_are_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_RESULT_RELEVANT_PACKAGES", ("z3-solver", "no-such-package"))
    assert package_versions() == (
        f"python {platform.python_version()} z3-solver {version('z3-solver')} no-such-package None"
    )
