"""Confinement of programs that the runtime starts: a launcher, a private folder, and a control group."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import aeros
from aeros.files import temporary_folder
from aeros.runtime.isolation.control_groups import ControlGroup, ControlGroupError, ControlGroups
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.protocol import sanitize_text
from aeros.runtime.tools.exchange import ToolError
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.tools import Confinement

_LAUNCHER: Final = "aeros.runtime.tools.launcher"

_LAYERS: Final = frozenset(("landlock", "seccomp", "rlimits", "cgroups"))
"""Layers that confine programs; a site may require others, for skill code."""

_MAX_LINE: Final = 200
"""Most characters of error output that a message has."""


@dataclass(frozen=True)
class ConfinedCommand:
    """Command that starts a program confined.

    Attributes:
        arguments: the launcher and its arguments; to be started by this thread, in a new session.
        report: file in which the launcher says why it did not start the program, or killed it.
        errors: file that has the program's error output.
    """

    arguments: tuple[str, ...]
    report: Path
    errors: Path

    def describe(self, failure: str) -> str:
        """Describe the failure of a run.

        Args:
            failure: the failure as it shows from outside.

        Returns:
            The launcher's reason; without one, `failure` and the last line of the program's error output.
        """
        if reason := _printable(_tail(self.report)):
            return reason
        lines = _tail(self.errors).strip().splitlines()
        printable = _printable(lines[-1])[:_MAX_LINE] if lines else ""
        return f"{failure}; its last line of errors: {printable}" if printable else failure


@contextmanager
def confine(
    command: Sequence[str], confinement: Confinement, policy: IsolationPolicy, seconds: float
) -> Iterator[ConfinedCommand]:
    """Prepare the confinement of one run of a program; afterwards end what is left of it.

    Args:
        command: the program and its arguments.
        confinement: what it may use.
        policy: says which layers must be there, and if missing ones are refused.
        seconds: time of the run, s.

    Yields:
        The command to start.

    Raises:
        ToolError: there is no such program; the site requires a layer that programs do not have, or a
            control group, and there is none; or it opens the runtime's folder of the run.
    """
    program = shutil.which(command[0], path=os.defpath)
    if program is None:
        raise ToolError(f"it cannot be started: No such file or directory: {command[0]!r}")
    required = sorted(policy.required_layers) if policy.refuses_missing else []
    if lacking := [layer for layer in required if layer not in _LAYERS]:
        raise ToolError(f"it cannot be confined: {', '.join(lacking)}: programs of tools do not have it")
    with ExitStack() as stack:
        # Removed last: processes in the group may still write there.
        folder = stack.enter_context(temporary_folder())
        private, canary = folder / "private", folder / "canary"
        private.mkdir(0o700)
        canary.touch(0o600)
        _check_apart((*confinement.reads, *confinement.writes), folder)
        group = _make_group(confinement, stack, is_required="cgroups" in required)
        plan = {
            "parent": os.getpid(),
            "command": [str(one) for one in command],
            "program": os.path.realpath(program),
            "reads": [*confinement.reads, *_named_files(command[1:])],
            "writes": list(confinement.writes),
            "network": confinement.network,
            "memory": confinement.memory,
            "processes": confinement.processes,
            "seconds": seconds,
            "required": required,
            "private": str(private),
            "canary": str(canary),
            "report": str(folder / "report"),
            "errors": str(folder / "errors"),
            "entrances": [] if group is None else list(group.entrance_paths),
        }
        yield ConfinedCommand(_launch(json.dumps(plan)), folder / "report", folder / "errors")


def _check_apart(paths: Sequence[str], folder: Path) -> None:
    """Check that no path opens the folder of the run, which holds the report; links are followed.

    Raises:
        ToolError: one does.
    """
    for path in paths:
        if folder.resolve().is_relative_to(Path(path).resolve()):
            raise ToolError(f"it cannot be confined: {path} contains the runtime's temporary files")


def _printable(text: str) -> str:
    """Replace the characters of a text that could steer a terminal."""
    return "".join(one if one.isprintable() else "\N{REPLACEMENT CHARACTER}" for one in sanitize_text(text))


def _tail(file: Path) -> str:
    """Read the end of a file; empty if there is none."""
    try:
        with file.open("rb") as opened:
            opened.seek(max(0, file.stat().st_size - 4 * _MAX_LINE))
            return opened.read(4 * _MAX_LINE).decode("utf-8", "replace")
    except OSError:
        return ""


def _make_group(confinement: Confinement, stack: ExitStack, *, is_required: bool) -> ControlGroup | None:
    try:
        group = ControlGroups().make()
        stack.callback(group.close)
        stack.callback(group.kill)
        group.set_limits(
            ProcessLimits(confinement.memory, float(confinement.processor), confinement.processes)
        )
    except ControlGroupError as failure:
        if is_required:
            raise ToolError(f"it cannot be confined: cgroups: {failure}") from failure
        return None
    return group


def _named_files(arguments: Sequence[str]) -> list[str]:
    """Return the files that arguments name as absolute paths, such as a script."""
    return [one for one in arguments if one.startswith("/") and Path(one).is_file()]


def _launch(plan: str) -> tuple[str, ...]:
    """Return the command of the launcher; no installed start-up code (`.pth` files) runs in it."""
    place = str(Path(aeros.__file__).resolve().parent.parent)
    code = f"import sys; sys.path.append({place!r}); import {_LAUNCHER} as one; one.main(sys.argv[1])"
    return (str(Path(sys.executable).resolve()), "-I", "-S", "-B", "-c", code, plan)
