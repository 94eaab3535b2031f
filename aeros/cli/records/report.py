"""`aeros report`: write a finished run as one HTML file that needs no network."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.apps.report_page.film_element import FilmFile, find_film
from aeros.apps.report_page.page import page_of
from aeros.apps.report_page.run_data import AUDIT, RunData, read_run_data
from aeros.cli.arguments import add_command, add_signature_check, existing_path, writable_path
from aeros.cli.latest_run import add_run_argument, find_run_folder
from aeros.cli.terminal.rendering import print_labelled
from aeros.exit_codes import Exit
from aeros.files import replace_durably
from aeros.runtime.audit.checkpoints import AnchorError, verify_signed
from aeros.runtime.audit.keys import InvalidKeyError, read_public_key
from aeros.runtime.registry.change_log import recorded_configurations
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
The page shows the sequence of skills, a timeline with faults and stops, measurements against the bounds of
the site's rules, every decision with its reasons, the result of the check of the audit log, and the film of
the run if `aeros film` has made one in its folder.  Bounds are drawn if a site with the digest in the log is
available: that of --site, those that were in force on this robot, or the reference site.  Exits with 1 if
the log is not sound; the page gives the reason.

examples:
  aeros report                        the newest run in `runs`
  aeros report runs/demo
  aeros report runs/demo -o demo.html --public-key audit.key.pub
  aeros report runs/demo --site cell.yaml
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "report", __doc__, _EXAMPLES)
    add_run_argument(parser, "folder")
    parser.add_argument(
        "-o", "--output", type=writable_path, metavar="FILE", help="default: report.html in that folder"
    )
    parser.add_argument("--site", type=existing_path, help="the site file of the run")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    add_signature_check(parser)
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if arguments.anchor and arguments.public_key is None:
        print("aeros: --anchor needs --public-key", file=sys.stderr)
        return Exit.USAGE
    folder = find_run_folder(arguments.folder)
    if not (folder / AUDIT).is_file():
        print(f"aeros: there is no {AUDIT} in `{folder}`", file=sys.stderr)
        return Exit.REJECTED
    given = None if arguments.site is None else read_site(arguments.site)
    left = read_run_data(folder)
    try:
        signed = _signature_text(left, folder / AUDIT, arguments.public_key, arguments.anchor)
    except (AnchorError, InvalidKeyError) as fault:
        print(f"aeros: {fault}", file=sys.stderr)
        return Exit.REJECTED
    wanted = {one.site for one in left.decisions}
    if given is not None and wanted and given.digest not in wanted:
        print(f"aeros: the run did not use `{arguments.site}`: its digest is not in the log", file=sys.stderr)
        return Exit.REJECTED
    at_hand = available_sites(arguments.state, arguments.site)
    sites = {site.digest: site for site in at_hand if site.digest in wanted}
    path = arguments.output or folder / "report.html"
    return write_report(left, path, sites, signed, find_film(folder, path.parent))


def write_report(
    left: RunData, path: Path, sites: Mapping[str, Site], signed: str, film: FilmFile | None = None
) -> Exit:
    """Write the page about a run, and print a summary.

    Args:
        left: Data of the run.
        path: The HTML file.
        sites: Available sites of the run, by digest.
        signed: Result of the check of signatures, as text.
        film: The film of the run; None if there is none.

    Returns:
        The exit code: rejected if the file cannot be written or the audit log is not sound.
    """
    page = page_of(left, path.absolute().parent.name, sites, signed, film)
    try:
        replace_durably(path, page.encode("utf-8", "backslashreplace"))
    except OSError as error:
        print(f"aeros: cannot write `{path}`: {error.strerror}", file=sys.stderr)
        return Exit.REJECTED
    sound = "chain sound" if left.chain.is_sound else f"NOT SOUND: {left.chain.reason}"
    print_labelled("report", f"{path}, {len(page) // 1024} KB, {left.chain.records} records, {sound}")
    return Exit.SUCCESS if left.chain.is_sound else Exit.REJECTED


def _signature_text(left: RunData, log: Path, key: Path | None, anchors: Sequence[Path]) -> str:
    """Check the signatures; if they do not match, mark the chain of `left` as not sound."""
    if key is None:
        return "not checked: without --public-key a fully rewritten log is not detected"
    found = verify_signed(log, read_public_key(key), *anchors)
    left.chain = found.chain
    anchored = f"; the anchor's first {found.anchored} records are all there" if anchors else ""
    return f"of the first {found.signed} records{anchored}"


def read_site(path: Path) -> Site:
    """Read a site file.

    Args:
        path: The file.

    Returns:
        The site.

    Raises:
        UserError: It cannot be read, or has faults.
        AssertionError: It was not read, and no fault was reported.
    """
    sink = Diagnostics()
    site = load_site(path, sink)
    sink.raise_if_errors()
    if site is None:
        raise AssertionError("a site that was not read was not reported")
    return site


def available_sites(state: Path, given: Path | None) -> Iterable[Site]:
    """Yield the sites under which a run may have been, as far as their files can be read.

    Args:
        state: The agent's state folder.
        given: A further site file; None for none.

    Yields:
        The given site, the reference site, and each site that was in force on this robot.
    """
    if given is not None:
        yield read_site(given)
    yield from _with_blocks(reference_site_path(), ())
    registry = Registry(state)
    if registry.exists:
        for snapshot in recorded_configurations(registry.folder).values():
            try:
                blocks = registry.blocks(snapshot)
            except UserError:  # files of the past may be gone
                continue
            yield from _with_blocks(registry.folder / snapshot.site, blocks)


def _with_blocks(path: Path, blocks: tuple[OperatorOverride, ...]) -> Iterable[Site]:
    site = load_site(path, Diagnostics()) if path.is_file() else None
    return () if site is None else (site.with_overrides(blocks),)
