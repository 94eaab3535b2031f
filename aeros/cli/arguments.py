"""Commands with their help, argument types that commands share, and common warnings."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.cli.help_text import WrappedEpilog
from aeros.cli.near_paths import near_path
from aeros.distribution import install_command
from aeros.exit_codes import EXIT_CODES, UsageError
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT, QUESTION_SECONDS
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    from aeros.runtime.registry.registry_governor import RegistryGovernor
    from aeros.spec.backends.solver_results import SecondSolver

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]


_PORT_DIGITS: Final = 5


def add_command(
    commands: Subparsers, name: str, description: str | None, examples: str
) -> argparse.ArgumentParser:
    """Add a command whose help ends with examples and exit codes.

    Args:
        commands: Subparsers to add it to.
        name: The command's name.
        description: Text before the options.
        examples: Text after the options, kept line by line.

    Returns:
        The command's parser.
    """
    return commands.add_parser(
        name,
        help=(description or "").replace("%", "%%"),
        description=description,
        epilog=f"{examples}\n{EXIT_CODES}",
        formatter_class=WrappedEpilog,
    )


def add_colour(parser: argparse.ArgumentParser) -> None:
    """Add the option `--color`.

    Args:
        parser: Parser of the command.
    """
    parser.add_argument(
        "--color",
        choices=("auto", "always", "never"),
        default="auto",
        help="colours; auto is by terminal, NO_COLOR and FORCE_COLOR (default: auto)",
    )


def add_verbosity(parser: argparse.ArgumentParser, *, quiet: str, verbose: str) -> None:
    """Add the options `-q` and `-v`, of which one can be given.

    Args:
        parser: Parser of the command.
        quiet: What the command prints under `-q`.
        verbose: What it prints under `-v`.
    """
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("-q", "--quiet", action="store_true", help=quiet)
    choice.add_argument("-v", "--verbose", action="store_true", help=verbose)


def existing_path(text: str) -> Path:
    """Parse the path of an existing file or folder.

    Args:
        text: The argument.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: Nothing exists at that path.
    """
    if not text:
        raise argparse.ArgumentTypeError("the path is empty")
    path = Path(text)
    try:
        path.stat()
    except FileNotFoundError as error:
        if path.is_symlink():
            raise argparse.ArgumentTypeError(
                f"`{escape_invisible(text)}` is a link to `{escape_invisible(str(path.readlink()))}`, "
                "which does not exist"
            ) from error
        near = near_path(text)
        cure = "" if near is None else f"; did you mean `{escape_invisible(near)}`?"
        raise argparse.ArgumentTypeError(f"no file or folder `{escape_invisible(text)}`{cure}") from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a path"
        raise argparse.ArgumentTypeError(f"`{escape_invisible(text)}`: {reason}") from error
    return path


def existing_folder(text: str) -> Path:
    """Parse the path of an existing folder.

    Args:
        text: The argument.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: No folder exists at that path.
    """
    path = existing_path(text)
    if not path.is_dir():
        raise argparse.ArgumentTypeError(f"`{escape_invisible(text)}` is a file; give a folder")
    return path


def add_module_folders(parser: argparse.ArgumentParser, help_: str) -> None:
    """Add the option `--ecms`, whose values are all loaded.

    Args:
        parser: Parser of a command.
        help_: Description of the modules, which ends with the default.
    """
    parser.add_argument(
        "--ecms",
        type=existing_path,
        action="append",
        metavar="PATH",
        help=f"{help_}; a module or a folder of modules; may be repeated",
    )


def solver_budget(text: str) -> int:
    """Parse a solver budget.

    Args:
        text: The argument.

    Returns:
        The budget in Z3 resource units.

    Raises:
        argparse.ArgumentTypeError: The text is not a whole number from 1 to 2^32 - 1.
    """
    if not text.isascii() or not text.isdigit() or not 0 < int(text) < 2**32:
        raise argparse.ArgumentTypeError("expected a whole number between 1 and 4294967295")
    return int(text)


def add_solver_limits(parser: argparse.ArgumentParser) -> None:
    """Add the options that limit the solver.

    Args:
        parser: Parser of the command.
    """
    parser.add_argument(
        "--rlimit",
        type=solver_budget,
        default=DEFAULT_RLIMIT,
        help="solver budget for one query, in Z3 resource units (default: %(default)s)",
    )
    parser.add_argument(
        "--question-timeout",
        type=seconds_from(0.1),
        default=QUESTION_SECONDS,
        metavar="SECONDS",
        help="time limit for one query; without an answer it is undecided (default: %(default)g)",
    )


def process_count(text: str) -> int:
    """Parse a number of processes.

    Args:
        text: The argument.

    Returns:
        The largest number of processes to use.

    Raises:
        argparse.ArgumentTypeError: The text is not a whole number from 1 to 256.
    """
    if not text.isascii() or not text.isdigit() or not 0 < int(text) <= 256:
        raise argparse.ArgumentTypeError("expected a whole number between 1 and 256")
    return int(text)


def available_cpus() -> int:
    """Count the processors that this process may use.

    Returns:
        The number of processors, at least 1.
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def seconds_from(lowest: float) -> Callable[[str], float]:
    """Make a parser of a time of at most an hour.

    Args:
        lowest: The least time that is accepted, s.

    Returns:
        A parser of an argument, which gives the time in s.
    """

    def parse(text: str) -> float:
        try:
            seconds = float(text)
        except ValueError:
            seconds = nan
        if not lowest <= seconds <= 3600:
            raise argparse.ArgumentTypeError(f"expected a number of seconds from {lowest:g} to 3600")
        return seconds

    return parse


def as_port(text: str) -> int | None:
    """Read the number of a port.

    Args:
        text: The argument.

    Returns:
        The number, 0 to 65535; None if it is none.
    """
    is_number = text.isascii() and text.isdigit() and len(text) <= _PORT_DIGITS
    return int(text) if is_number and int(text) < 1 << 16 else None


def second_solver(text: str) -> SecondSolver:
    """Parse the name of a solver other than Z3.

    Args:
        text: The argument.

    Returns:
        The solver.

    Raises:
        argparse.ArgumentTypeError: The name is unknown, or the solver is not installed.
    """
    if text != "cvc5":
        raise argparse.ArgumentTypeError("expected `cvc5`")
    try:
        from aeros.spec.backends.cvc5_solver import Cvc5
    except ImportError as error:
        raise argparse.ArgumentTypeError(f"cvc5 is not installed: {install_command('cvc5')}") from error
    return Cvc5()


def writable_path(text: str) -> Path:
    """Parse the path of a file to write.

    Args:
        text: The argument.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: It is a folder, a file that AEROS reads, or in no folder.
    """
    if not text:
        raise argparse.ArgumentTypeError("the path is empty")
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"`{escape_invisible(text)}` is a folder; name a file in it")
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(
            f"`{escape_invisible(text)}`: its folder does not exist; create it first"
        )
    try:
        path.stat()
    except FileNotFoundError:
        pass
    except OSError as error:
        raise argparse.ArgumentTypeError(f"`{escape_invisible(text)}`: {error.strerror}") from error
    # A link is written through, so the file that it leads to counts.
    if path.is_file() and path.resolve().suffix.lower() in _INPUT_SUFFIXES:
        raise argparse.ArgumentTypeError(
            f"`{escape_invisible(text)}` is an input of AEROS and would be overwritten; name another file"
        )
    return path


_INPUT_SUFFIXES: Final = frozenset({".jsonl", ".lock", ".py", ".sqlite3", ".toml", ".yaml", ".yml"})
"""Suffixes of modules, sites, runs and state; no command writes one of them where an option says."""


def mcap_path(text: str) -> Path:
    """Parse the path of an MCAP file to write.

    Args:
        text: The argument.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: The suffix is not `.mcap`.
    """
    return _with_suffix(text, (".mcap",))


def film_path(text: str) -> Path:
    """Parse the path of a film to write; its suffix selects the format.

    Args:
        text: The argument.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: The suffix is not one of `FILM_SUFFIXES`.
    """
    return _with_suffix(text, FILM_SUFFIXES)


def writable_film_path(text: str) -> Path:
    """Parse the path of a film to write now: it is drawn only if its folder exists.

    Args:
        text: The argument.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: The suffix is not one of `FILM_SUFFIXES`, or its folder does not exist.
    """
    return writable_path(str(film_path(text)))


FILM_SUFFIXES = (".mp4", ".webp", ".gif")


def _with_suffix(text: str, known: tuple[str, ...]) -> Path:
    path = Path(text)
    if path.suffix not in known:
        expected = f"expected a file named *{', *'.join(known)}"
        raise argparse.ArgumentTypeError(f"`{escape_invisible(text)}`: {expected}")
    return path


def parse_seed(text: str) -> int:
    """Parse a seed.

    Args:
        text: The argument.

    Returns:
        The seed, from 0 to 2^63 - 1.

    Raises:
        argparse.ArgumentTypeError: The text is not such a number.
    """
    if not text.isascii() or not text.isdigit() or not int(text) < 2**63:
        raise argparse.ArgumentTypeError("expected a whole number from 0 to 2^63 - 1")
    return int(text)


def add_signing(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how the audit log of a run is signed.

    Args:
        parser: Parser of the command.
    """
    parser.add_argument(
        "--audit-key",
        type=existing_path,
        metavar="FILE",
        help="sign the audit log with this key (default: audit.key in the agent's folder, made at first use)",
    )
    parser.add_argument(
        "--anchor",
        type=writable_path,
        action="append",
        default=[],
        metavar="FILE",
        help="keep a further copy of the log's newest signature in this file, outside the agent's folder; "
        "may be repeated",
    )
    parser.add_argument("--unsigned", action="store_true", help="do not sign the audit log")


def add_signature_check(parser: argparse.ArgumentParser) -> None:
    """Add the options that name the key and the anchors with which an audit log is checked.

    Args:
        parser: Parser of the command.
    """
    parser.add_argument(
        "--public-key", type=existing_path, help="public key that the log must be signed with"
    )
    parser.add_argument(
        "--anchor",
        type=existing_path,
        action="append",
        default=[],
        help="file with a copy of the newest checkpoint; may be repeated",
    )


def require_signing_options(arguments: argparse.Namespace) -> None:
    """Check that the options of `add_signing` fit together.

    Args:
        arguments: Parsed options.

    Raises:
        UsageError: `--unsigned` is given with a key or an anchor.
    """
    if arguments.unsigned and (arguments.audit_key is not None or arguments.anchor):
        raise UsageError("--unsigned cannot be combined with --audit-key or --anchor")


def warn_of_withheld_modules(governor: RegistryGovernor) -> None:
    """Print a warning for each module of the run that the operator does not let it use.

    Args:
        governor: Governor of the run.
    """
    for reason in governor.withheld.values():
        print_warning(f"{reason} on this robot, so the run does not use it")


def print_warning(text: str) -> None:
    """Print a warning to standard error.

    Args:
        text: The warning.
    """
    print(f"aeros: warning: {text}", file=sys.stderr)
