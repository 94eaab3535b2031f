"""`aeros`: parses arguments, calls one command, and turns whatever happens into an exit code."""

from __future__ import annotations

import argparse
import os
import sys
import traceback
from collections.abc import Sequence

import aeros
from aeros.cli import decide, run, verify
from aeros.cli.exit_codes import EXIT_CODES, Exit
from aeros.spec.errors import UndecidedError, UserError
from aeros.spec.render import render_all


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; never lets a traceback out unless AEROS_DEBUG is set."""
    parsed = _parser().parse_args(arguments)
    try:
        return int(parsed.command(parsed))
    except UserError as error:
        print(render_all(error.diagnostics), file=sys.stderr)
        return Exit.UNDECIDED if isinstance(error, UndecidedError) else Exit.REJECTED
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return Exit.INTERRUPTED
    except BrokenPipeError:
        # The reader went away; nothing more can be said, and Python must not try at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Exit.INTERRUPTED
    except Exception as error:
        if os.environ.get("AEROS_DEBUG"):
            traceback.print_exc()
        print(
            f"aeros: this is a bug in aeros, not in your files: {type(error).__name__}: {error}\n"
            "Please report it with the output of the same command under AEROS_DEBUG=1.",
            file=sys.stderr,
        )
        return Exit.OUR_BUG


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="aeros",
        description="Capability packages proved safe before installation, actions decided before motion.",
        epilog=EXIT_CODES,
    )
    parser.add_argument("--version", action="version", version=f"aeros {aeros.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for command in (verify, run, decide):
        command.add_to(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
