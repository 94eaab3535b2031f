"""`aeros film`: make a film of a finished run, with the reason of each decision."""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Final

from aeros.apps.film.run_film import FilmError, film_imports, film_run
from aeros.cli.arguments import add_command, existing_path, writable_film_path
from aeros.cli.latest_run import add_run_argument, find_run_folder
from aeros.cli.records.report import available_sites
from aeros.cli.terminal.progress import ProgressLine
from aeros.cli.terminal.rendering import print_labelled
from aeros.exit_codes import Exit
from aeros.files import replace_durably
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.film.film import FilmOptions

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES: Final = """\
`aeros run` records poses on the physics plants; this command draws them afterwards.  The film shows the
decision in force and the rule that bit, speed, force and distance of people against their bounds, rings that
people must keep, the decided path, and what the robot's camera sees.  Bounds are shown if a site with the
digest in the log is available, as for `aeros report`.  It needs OpenGL, but no display: MUJOCO_GL selects a
back end of MuJoCo, egl, osmesa or glfw; without it they are tried in this order.

examples:
  aeros film runs/demo
  aeros film runs/demo --speed 4 --out demo.mp4
  aeros film runs/demo --from 20 --to 30 --size 640x360 --camera fixed --out stop.webp
"""

_SIZE: Final = re.compile(r"([1-9]\d{1,3})x([1-9]\d{1,3})")


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "film", __doc__, _EXAMPLES)
    add_run_argument(parser, "folder")
    parser.add_argument(
        "-o", "--out", type=writable_film_path, metavar="FILE",
        help="film to write: *.mp4, *.webp or *.gif (default: film.mp4 in that folder)",
    )  # fmt: skip
    parser.add_argument(
        "--size",
        type=_size,
        metavar="WxH",
        help="width and height, pixels (default: 1280x720; 640x360 for *.webp and *.gif)",
    )
    parser.add_argument("--speed", type=_speed, default=1.0, help="times as fast as the run (default: 1)")
    parser.add_argument(
        "--camera", choices=("orbit", "fixed"), default="orbit",
        help="turn slowly around the arm, or stand (default: orbit)",
    )  # fmt: skip
    parser.add_argument(
        "--from", type=_time, dest="start", default=0.0, metavar="S", help="start, in s of the run"
    )
    parser.add_argument("--to", type=_time, dest="end", metavar="S", help="end, in s of the run")
    parser.add_argument("--title", default="", help="text at the top (default: the instruction of the run)")
    parser.add_argument("--no-captions", action="store_true", help="draw the bodies alone")
    parser.add_argument("--site", type=existing_path, help="the site file of the run")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_command)


def _size(text: str) -> tuple[int, int]:
    match = _SIZE.fullmatch(text)
    if match is None:
        raise argparse.ArgumentTypeError(f"`{text}`: expected a width and a height, as in 1280x720")
    width, height = int(match[1]), int(match[2])
    if width % 2 or height % 2 or not (320 <= width <= 3840 and 180 <= height <= 2160):
        raise argparse.ArgumentTypeError(f"`{text}`: expected even numbers from 320x180 to 3840x2160")
    return width, height


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return -1.0


def _speed(text: str) -> float:
    if not 0.1 <= (speed := _number(text)) <= 100.0:
        raise argparse.ArgumentTypeError(f"`{text}`: expected a number from 0.1 to 100")
    return speed


def _time(text: str) -> float:
    if not 0.0 <= (seconds := _number(text)) <= 1e7:
        raise argparse.ArgumentTypeError(f"`{text}`: expected a number of seconds from 0 on")
    return seconds


def _command(arguments: argparse.Namespace) -> Exit:
    folder = find_run_folder(arguments.folder)
    path: Path = arguments.out or folder / "film.mp4"
    if arguments.end is not None and arguments.end <= arguments.start:
        print("aeros: --to must be after --from", file=sys.stderr)
        return Exit.USAGE
    try:
        with TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        print(f"aeros: cannot write `{path}`: {error.strerror}; give a file with --out", file=sys.stderr)
        return Exit.REJECTED
    sites = {site.digest: site for site in available_sites(arguments.state, arguments.site)}
    options = {
        "size": arguments.size or default_size(path),
        "speed": arguments.speed,
        "camera": arguments.camera,
        "start": arguments.start,
        "end": arguments.end,
        "title": arguments.title,
        "has_captions": not arguments.no_captions,
    }
    return write_film(folder, path, sites, options)


def default_size(path: Path) -> tuple[int, int]:
    """Return the size of a film without the option.

    Args:
        path: The film's file.

    Returns:
        Width and height, pixels.
    """
    return (1280, 720) if path.suffix == ".mp4" else (640, 360)


def write_film(folder: Path, path: Path, sites: Mapping[str, Site], options: Mapping[str, object]) -> Exit:
    """Write the film of a run, and print a summary.

    Args:
        folder: Folder of the run.
        path: The film's file.
        sites: Available sites of the run, by digest.
        options: Fields of `FilmOptions`.

    Returns:
        The exit code: rejected if the film cannot be made or written.
    """
    began = time.monotonic()
    try:
        chosen = _film_options({"size": default_size(path), **options})
        content = film_run(folder, path, chosen, sites, _shows_progress())
        replace_durably(path, content, is_private=False)
    except FilmError as error:
        print(f"aeros: {error}", file=sys.stderr)
        return Exit.REJECTED
    except OSError as error:
        print(f"aeros: cannot write `{path}`: {error.strerror}", file=sys.stderr)
        return Exit.REJECTED
    seconds = time.monotonic() - began
    print_labelled("film", f"{path}, {len(content) / 1e6:.1f} MB, drawn in {seconds:.0f} s")
    return Exit.SUCCESS


def _film_options(options: Mapping[str, object]) -> FilmOptions:
    """Return options of a film.

    Raises:
        FilmError: A package is missing, or there is no OpenGL.
    """
    with film_imports():
        from aeros.sim.film.film import FilmOptions
    return FilmOptions(**options)  # type: ignore[arg-type]


def _shows_progress() -> Callable[[int, int], None]:
    """Return a function that shows how far a film is, once that takes long."""
    line: ProgressLine | None = None

    def show(done: int, total: int) -> None:
        nonlocal line
        line = ProgressLine(total) if line is None else line
        line.show("film: pictures", done)
        if done == total:
            line.end()

    return show
