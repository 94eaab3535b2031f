"""`aeros live`: serve the page of the run under way to browsers on this host."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Set
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.apps.live_page.page_server import PageServer
from aeros.apps.live_page.run_page import RunPage
from aeros.cli.arguments import add_command, as_port, existing_path, seconds_from
from aeros.cli.latest_run import find_run_folder, latest_run
from aeros.cli.records.report import available_sites, read_site
from aeros.cli.terminal.rendering import print_labelled
from aeros.exit_codes import Exit, UsageError
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_NICENESS: Final = 10
"""Niceness that is added: a process of the run, with 0, gets nine times the processor time of this one."""

_EXAMPLES = """\
The page is that of `aeros report`, made of the files as far as they are written: headline, cell from above,
plan, timeline, bounds and decisions.  A browser loads it again every few seconds.  It follows the latest run
of the robot folder --state, and the next one once that begins.  It only reads the run's files, and gives way
to the run where both need the processor.  Every user of this host can open it.  Ctrl-C ends it.

examples:
  aeros live
  aeros live --state /srv/robot7 --port 8766
  aeros live --run runs/demo --interval 2
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "live", __doc__, _EXAMPLES)
    parser.add_argument(
        "--run",
        type=existing_path,
        metavar="FOLDER|LOG",
        help="a run's output folder or audit log (default: the latest of --state)",
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros report`)")
    parser.add_argument(
        "--port", type=_port, default=0, help="port at 127.0.0.1 (default: any free one, which is printed)"
    )
    parser.add_argument(
        "--interval",
        type=seconds_from(1.0),
        default=5.0,
        metavar="SECONDS",
        help="time after which a browser loads the page again (default: 5)",
    )
    parser.set_defaults(command=_command)


def _port(text: str) -> int:
    """Parse a port.

    Raises:
        argparse.ArgumentTypeError: it is none.
    """
    port = as_port(text)
    if port is None:
        raise argparse.ArgumentTypeError(f"`{text}`: is no port, which is a number from 0 to 65535")
    return port


def _command(arguments: argparse.Namespace) -> Exit:
    given = None if arguments.site is None else read_site(arguments.site)
    run = None if arguments.run is None else find_run_folder(arguments.run)

    def find_run() -> tuple[Path, bool] | None:
        found = latest_run(arguments.state)
        if run is None:
            return found
        return run, found is not None and found[1] and found[0] == run.resolve()

    def find_sites(digests: Set[str]) -> Mapping[str, Site]:
        sites = chain(() if given is None else (given,), available_sites(arguments.state, None))
        return {site.digest: site for site in sites if site.digest in digests}

    try:
        server = PageServer(arguments.port, RunPage(find_run, find_sites).html, arguments.interval)
    except OSError as error:
        raise UsageError(f"cannot listen at port {arguments.port}: {error.strerror}") from error
    with server:
        print_labelled("live", server.url)
        os.nice(_NICENESS)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
    return Exit.SUCCESS
