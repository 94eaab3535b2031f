"""`aeros top`: show a live view of a run in another terminal; keys pause and stop the robot."""

from __future__ import annotations

import argparse
import json
import shutil
import signal
import sys
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.apps.report_page.run_data import plan_step_states
from aeros.apps.run_follower import RunFollower
from aeros.cli.arguments import add_command, existing_path, seconds_from
from aeros.cli.latest_run import latest_run
from aeros.cli.records.report import available_sites
from aeros.cli.terminal.rendering import table_lines
from aeros.cli.terminal.streams import print_data, shows_colour, write_control
from aeros.cli.top.keyboard import Keyboard, open_keyboard
from aeros.cli.top.operator_call import OperatorCall
from aeros.cli.top.resources import quota_text, resource_rows, tools_view
from aeros.cli.top.screen import ScreenAction, Style, StyledLine, TopScreen
from aeros.exit_codes import Exit
from aeros.runtime.execution.governor import OperatorCommand
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/top/1"

_EXAMPLES = """\
Shows the plan and its progress, the latest decisions with their reasons, measurements with their ages,
quotas, the smallest margins to the rules, and the resources that modules and tools use, with their limits.
On a terminal it continues until `q` or Ctrl-C, from run to run, and keys give commands of the operator:
`p` as `aeros pause`, and `s`, then `y`, as `aeros stop`.  Arrows, PgUp, PgDn, Home and End scroll.
Otherwise it prints each change until the run has ended.  Exits with 1 if there is no run.

examples:
  aeros top
  aeros top --once --format json
  aeros top --run runs/demo --once
"""
_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
_DECISIONS, _BOUNDS, _EVENTS, _STOPS = 8, 14, 4, 4


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "top", __doc__, _EXAMPLES)
    parser.add_argument(
        "--run", type=existing_path, help="the folder of a run (default: the latest of --state)"
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros report`)")
    parser.add_argument("--once", action="store_true", help="print the current state once and exit")
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument(
        "--interval",
        type=seconds_from(0.05),
        default=0.5,
        metavar="SECONDS",
        help="refresh interval (default: 0.5)",
    )
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    viewer = _RunViewer(arguments.state, arguments.run, arguments.site)
    if arguments.once:
        return _print(viewer.snapshot(), arguments.format)
    if arguments.format == "text" and sys.stdout.isatty():
        return _watch(viewer, arguments.state, arguments.interval)
    shown = viewer.snapshot()
    code = _print(shown, arguments.format)
    while shown is not None and shown["is_running"]:
        time.sleep(arguments.interval)
        view = viewer.snapshot()
        if view is not None and view != shown:
            code, shown = _print(view, arguments.format), view
    return code


def _watch(viewer: _RunViewer, state: Path, every: float) -> Exit:
    """Refresh the view, and obey keys, until `q` or Ctrl-C."""
    try:
        with _alternate_screen(), open_keyboard() as keyboard:
            screen = TopScreen(has_keys=keyboard.is_there, has_colours=shows_colour(sys.stdout))
            with closing(OperatorCall(state, screen.set_message)) as operator:
                _run_screen(screen, keyboard, viewer, operator, every)
    except KeyboardInterrupt:
        pass
    return Exit.SUCCESS


def _run_screen(
    screen: TopScreen, keyboard: Keyboard, viewer: _RunViewer, operator: OperatorCall, every: float
) -> None:
    while True:
        view = viewer.snapshot()
        lines = [StyledLine("no runs found")] if view is None else list(_lines(view))
        columns, rows = shutil.get_terminal_size()
        write_control(screen.render(lines, columns, rows))
        sys.stdout.flush()
        for key in keyboard.wait(every):
            action = screen.press(key)
            if action is ScreenAction.QUIT:
                return
            if action is not None and (view is None or not view["is_running"]):
                screen.set_message(f"{action.value}: no run of this robot is under way here")
            elif action is not None:
                operator.give(_COMMANDS[action])


_COMMANDS: Final = {ScreenAction.PAUSE: OperatorCommand.PAUSE, ScreenAction.STOP: OperatorCommand.STOP}


class _RunViewer:
    """Viewer of the latest run, and of the next one once that begins."""

    def __init__(self, state: Path, folder: Path | None, site: Path | None) -> None:
        self._state = state
        self._given = folder
        self._site = site
        self._sites: dict[str, Site] = {}
        self._following: RunFollower | None = None

    def snapshot(self) -> dict[str, Any] | None:
        """Return the current state as JSON; None if there is no run."""
        found = latest_run(self._state)
        folder = self._given or (None if found is None else found[0])
        if folder is None:
            return None
        if self._following is None or self._following.folder != folder:
            self._following = RunFollower(folder)
        is_there = found is not None and found[1] and found[0] == folder.resolve()
        self._following.read()
        return run_view(self._following, self._current_site(self._following.site), is_there=is_there)

    def _current_site(self, digest: str | None) -> Site | None:
        if digest is not None and digest not in self._sites:
            at_hand = available_sites(self._state, self._site)
            self._sites.update({site.digest: site for site in at_hand if site.digest == digest})
        return None if digest is None else self._sites.get(digest)


def run_view(run: RunFollower, site: Site | None, *, is_there: bool) -> dict[str, Any]:
    """Describe the current state of a run.

    Args:
        run: The run, read up to now.
        site: The site in force; None if its file is not available.
        is_there: True if the run's process exists.

    Returns:
        JSON values; times in plant seconds.
    """
    ended = run.ended
    parts = () if run.plan is None else plan_step_states(run.plan, run.runs)
    used = run.last[-1].usage if run.last else {}
    most = {} if site is None else {quota.id: quota.max_count for quota in site.quotas}
    single = [
        (name, reading) for name, reading in sorted(run.world.items()) if not isinstance(reading[0], list)
    ]
    events = [one for one in run.events if one.text][-_EVENTS:]
    quotas = {name: {"used": count, "at_most": most.get(name)} for name, count in used.items()}
    return {
        "schema": SCHEMA,
        "folder": str(run.folder),
        "is_running": is_there and ended is None,
        "is_paused": run.is_paused,
        "instruction": run.task_event.get("instruction"),
        "task": run.task_event.get("task"),
        "ended": None
        if ended is None
        else {name: ended.get(name) for name in ("reached", "reason", "skipped")},
        "time": run.now,
        "plan": [{"step": step, "how": how} for step, how in parts],
        "under_way": [
            {"skill": one.skill, "since": one.start_time} for one in run.runs if one.end_time is None
        ],
        "events": [{"time": one.time, "text": one.text} for one in events],
        "stops": [{"time": time, "text": text} for time, text in run.stops[-_STOPS:]],
        "counts": {verdict: run.counts[verdict] for verdict in ("ALLOW", "ATTENUATE", "DENY")},
        "decisions": [
            {
                "time": one.time,
                "verdict": one.decision,
                "skill": one.skill,
                "kind": one.kind,
                "reasons": [list(reason) for reason in one.reasons],
            }
            for one in list(run.last)[-_DECISIONS:]
        ],
        "quotas": quotas,
        "modules": run.modules,
        "tools": tools_view(site, run.tool_calls, quotas),
        "bounds": [
            {
                "rule": one.rule,
                "quantity": one.quantity,
                "unit": one.unit,
                "measured": one.measured,
                "at_most" if one.is_upper else "at_least": one.bound,
                "margin": one.margin,
            }
            for one in run.closest_bounds(site)
        ],
        "world": {name: {"value": value, "age": max(run.now - at, 0.0)} for name, (value, at) in single},
    }


# Text.


def _print(view: dict[str, Any] | None, form: str) -> Exit:
    if view is None:
        print("aeros: no runs found", file=sys.stderr)
        return Exit.REJECTED
    if form == "json":
        print_data(json.dumps(view), flush=True)
    else:
        print("\n".join(one.text for one in _lines(view)) + "\n", flush=True)
    return Exit.SUCCESS


_STATUS_SYMBOLS: Final = {"under way": "▶", "done": "✓", "failed": "✗", "to come": "·"}
_STEP_STYLES: Final = {
    "under way": Style.TITLE,
    "done": Style.GOOD,
    "failed": Style.BAD,
    "to come": Style.NORMAL,
}
_VERDICT_STYLES: Final = {"ATTENUATE": Style.WARNING, "DENY": Style.BAD}


def _lines(view: Mapping[str, Any]) -> Iterator[StyledLine]:
    """Format the view as text, the most urgent first."""
    for text, style in _unsafe_lines(view):
        yield StyledLine(escape_invisible(text), style)


def _unsafe_lines(view: Mapping[str, Any]) -> Iterator[StyledLine]:
    ended, counts = view["ended"], view["counts"]
    how, style = ("paused", Style.WARNING) if view["is_paused"] else ("runs", Style.TITLE)
    if ended is not None:
        how = "goal reached" if ended["reached"] is True else f"goal not reached: {ended['reason']}"
        how = "skipped, as its condition does not hold" if ended["skipped"] is True else how
        style = Style.GOOD if ended["reached"] is True else Style.BAD
    elif not view["is_running"]:
        how, style = "process ended without recording an end", Style.BAD
    yield StyledLine(f"{view['task'] or 'no task yet'}  {view['time']:.2f} s  {how}", style)
    yield StyledLine(
        f"decisions  {counts['ALLOW']} allowed, {counts['ATTENUATE']} attenuated, {counts['DENY']} denied"
        + "".join(f"   quota {name} {quota_text(quota)}" for name, quota in view["quotas"].items())
    )
    yield from _section(
        "plan",
        (
            StyledLine(f"{_STATUS_SYMBOLS[part['how']]} {part['step']}", _STEP_STYLES[part["how"]])
            for part in view["plan"]
        ),
    )
    yield from _section(
        "under way",
        (StyledLine(f"{one['skill']}  {view['time'] - one['since']:.2f} s") for one in view["under_way"]),
    )
    yield from _section("smallest margins", _bounds(view["bounds"][:_BOUNDS]))
    yield from _section("stops", (_timed(one, Style.BAD) for one in reversed(view["stops"])))
    yield from _section("latest decisions", map(_decision, reversed(view["decisions"])))
    yield from _section("agent", (_timed(one, Style.NORMAL) for one in reversed(view["events"])))
    yield from _section("resources", _table(resource_rows(view["modules"], view["tools"])))
    yield from _section("measured", _table(_world(view["world"]), right=(1,)))


def _section(title: str, lines: Iterable[StyledLine]) -> Iterator[StyledLine]:
    found = list(lines)
    if found:
        yield StyledLine("")
        yield StyledLine(title, Style.TITLE)
        yield from (StyledLine(f"  {text}", style) for text, style in found)


def _table(rows: Iterable[Sequence[str]], right: Collection[int] = ()) -> Iterator[StyledLine]:
    return map(StyledLine, table_lines(rows, width=None, right=right))


def _timed(one: Mapping[str, Any], style: Style) -> StyledLine:
    return StyledLine(f"{one['time']:8.2f} s  {one['text']}", style)


def _bounds(bounds: Sequence[Mapping[str, Any]]) -> Iterator[StyledLine]:
    """Format measured values beside their limits."""
    lines = table_lines(map(_bound, bounds), width=None, right=(1,))
    for one, text in zip(bounds, lines, strict=True):
        yield StyledLine(text, Style.BAD if one["margin"] < 0 else Style.NORMAL)


def _bound(one: Mapping[str, Any]) -> Sequence[str]:
    way, limit = ("at most", one["at_most"]) if "at_most" in one else ("at least", one["at_least"])
    limit_text = f"{way} {limit:.4g} {one['unit']}"
    rule = f"{one['rule']}{'  BROKEN' if one['margin'] < 0 else ''}"
    return one["quantity"], f"{one['measured']:.4g}", limit_text, rule


def _decision(one: Mapping[str, Any]) -> StyledLine:
    why = "; ".join(f"{code} {rule}: {text}" for code, rule, text in one["reasons"])
    text = f"{one['time']:8.2f} s  {one['verdict']:9} {one['skill']} {one['kind']}"
    style = _VERDICT_STYLES.get(one["verdict"], Style.NORMAL)
    return StyledLine(f"{text}  {why}" if why else text, style)


def _world(world: Mapping[str, Any]) -> Iterator[Sequence[str]]:
    """Format measured values with their ages: truth values and names first, then numbers."""
    for name, one in sorted(world.items(), key=lambda item: (type(item[1]["value"]) is float, item[0])):
        value = one["value"]
        shown = f"{value:.4g}" if type(value) is float else json.dumps(value)
        yield name, shown, f"{one['age']:.2f} s ago"


@contextmanager
def _alternate_screen() -> Iterator[None]:
    """Use the terminal's alternate screen, and restore the terminal however the block ends."""

    def leave(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    former = {number: signal.signal(number, leave) for number in (signal.SIGTERM, signal.SIGHUP)}
    write_control(_ENTER)
    try:
        yield
    finally:
        write_control(_LEAVE)
        sys.stdout.flush()
        for number, handler in former.items():
            signal.signal(number, handler)
