"""`aeros demo`: prove the modules that come with AEROS, then run one agent on the best simulator here."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.cli.arguments import add_command
from aeros.cli.plant_argument import best_plant
from aeros.cli.terminal.streams import print_line
from aeros.distribution import install_command
from aeros.exit_codes import Exit, UsageError
from aeros.session.plant_factory import PHYSICS_PLANTS
from aeros.spec.text.discovery import reference_modules_path, reference_site_path

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
It needs no files.  The simulator is the first of these that is installed: physics (PyBullet), mujoco,
kinematic (no contacts), symbolic (no motion: outcomes are drawn as declared).

examples:
  aeros demo
  aeros demo "clean the table" --out runs/clean
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "demo", __doc__, _EXAMPLES)
    parser.add_argument(
        "instruction",
        nargs="?",
        default="make dumplings",
        help='an instruction (default: "make dumplings")',
    )
    parser.add_argument("--out", type=Path, help="a new folder for the records (default: in runs/)")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    from aeros.cli.main import main  # which imports this module

    out = arguments.out
    if out is not None and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UsageError(f"`{out}` is not an empty folder; give a new one with --out")
    modules = str(reference_modules_path())
    site = ["--site", str(reference_site_path())]
    run = ["run", arguments.instruction, "--ecms", modules, *site, "--plant", best_plant()]
    run += ["--state", str(arguments.state)]
    run += [] if arguments.out is None else ["--out", str(arguments.out)]
    for words in (["verify", modules, *site, "--no-lock"], run):
        print_line(f"$ aeros {shlex.join(words)}")
        code = main(words)
        print()
        if code != Exit.SUCCESS:
            return Exit(code)
    if best_plant() not in PHYSICS_PLANTS:
        print_line(f"For physics and films: {install_command('film')}; then `aeros demo` and `aeros film`.")
    return Exit.SUCCESS
