"""Elaboration of tools: the services that carry out actions of a site, and what their answers may set."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from pathlib import PurePath
from typing import Final
from urllib.parse import urlsplit

from aeros.spec.declared import site as declared_site
from aeros.spec.declared import tools as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.quantities import elaborate_memory, elaborate_processor_share
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import FamilyType
from aeros.spec.expr.units import TIME
from aeros.spec.model.rules import JointRule, Rule
from aeros.spec.model.tools import Confinement, HttpService, McpService, Program, Tool
from aeros.spec.model.variables import Declared, History
from aeros.spec.text.fields import TextField

MAX_TIMEOUT: Final = 60
"""Greatest timeout of a call, s."""

_LOCAL: Final = ("localhost", "127.0.0.1", "::1")
_TEMPORARY: Final = "/tmp"  # noqa: S108 - no file is made there
_VARIABLE: Final = re.compile(r"[A-Z][A-Z0-9_]*")


def elaborate_tool(
    name: TextField,
    kind: declared_site.ActionKind,
    state: Mapping[str, Declared],
    diagnostics: Diagnostics,
) -> Tool | None:
    """Elaborate the tool of an action kind.

    Args:
        name: name of the action kind.
        kind: the declared action kind.
        state: state variables of the site by name.
        diagnostics: receives the faults.

    Returns:
        The tool; None if the kind has none, and after a report.
    """
    tool = kind.tool
    if tool is None:
        return None
    before = len(diagnostics)
    if kind.actuators or (kind.protective is not None and kind.protective.value):
        _report(name, "a service carries it out, so it can move no actuator and stop nothing", diagnostics)
    service = _service(name, tool, diagnostics)
    timeout = elaborate_quantity(tool.timeout, TIME, diagnostics) or Fraction(0)
    if not 0 < timeout <= MAX_TIMEOUT and len(diagnostics) == before:
        headline = f"a tool's timeout is above 0 s and at most {MAX_TIMEOUT} s"
        diagnostics.error("AE129", headline, tool.timeout.span)
    for answer in tool.answers:
        variable = resolve_name(answer, state, "a state variable of this site", diagnostics)
        if variable is None:
            continue
        if variable.sensor != name.value:
            headline = f"`{answer.value}` is measured by `{variable.sensor}`, not by `{name.value}`"
            help_ = f"declare it with `sensor: {name.value}`"
            diagnostics.error("AE137", headline, answer.span, help=(help_,))
        if isinstance(variable.variable.type, FamilyType):
            diagnostics.error("AE137", f"a tool cannot answer with a family: `{answer.value}`", answer.span)
    answered = {answer.value for answer in tool.answers}
    for variable in state.values():
        if variable.sensor == name.value and variable.name not in answered:
            headline = f"no answer sets `{variable.name}`, whose sensor is the tool `{name.value}`"
            diagnostics.error("AE137", headline, variable.span, help=("add it to `answers` of the tool",))
    if service is None or len(diagnostics) > before:
        return None
    channel = None if tool.channel is None else tool.channel.value
    return Tool(service, timeout, tuple(dict.fromkeys(answer.value for answer in tool.answers)), channel)


def check_words_of_overlay(
    site: declared_site.Site, overlay: declared_site.Overlay, diagnostics: Diagnostics
) -> bool:
    """Check that an overlay adds tools, their answers and other words, and changes no word of the site.

    A tool whose name is that of a sensor could answer with what that sensor measures.

    Args:
        site: the site as declared, with the overlays below.
        overlay: the overlay.
        diagnostics: receives the faults.

    Returns:
        True if nothing was reported.
    """
    before = len(diagnostics)
    sensors = {variable.sensor.value for _, variable in site.state}
    sensors |= {name.value for name, _ in site.sensors} | {one.sensor.value for _, one in site.cameras}
    used = {
        **{name.value: "a state variable" for name, _ in site.state},
        **dict.fromkeys(sensors, "a sensor"),
        **{name.value: "an action kind" for name, _ in site.actions},
    }
    for name, kind in overlay.actions:
        if name.value in used:
            headline = f"`{name.value}` is already {used[name.value]} of the site"
            diagnostics.error("AE121", headline, name.span, help=("choose another name for this tool",))
        if kind.tool is None:
            headline = f"an overlay adds no actions but tools, and `{name.value}` has no `tool`"
            diagnostics.error("AE137", headline, name.span, help=("declare it in the site file",))
    tools = {name.value for name, _ in overlay.actions}
    for name, variable in overlay.state:
        if name.value in used:
            headline = f"`{name.value}` is already {used[name.value]} of the site"
            diagnostics.error("AE121", headline, name.span, help=("choose another name for this answer",))
        if variable.sensor.value not in tools:
            headline = f"`{name.value}` is measured by `{variable.sensor.value}`, no tool of this overlay"
            help_ = "let its `sensor` be one of the tools under `actions`, or declare it in the site file"
            diagnostics.error("AE137", headline, variable.sensor.span, help=(help_,))
    for what, below, above in (
        ("an object", site.objects, overlay.objects),
        ("a definition", site.definitions, overlay.definitions),
    ):
        names = {name.value for name, _ in below}
        for name, _ in above:
            if name.value in names:
                headline = f"`{name.value}` is already {what} of the site"
                diagnostics.error("AE121", headline, name.span, help=("choose another name",))
    return len(diagnostics) == before


def check_rules_read_no_answers(
    tools: Mapping[str, Tool],
    rules: Iterable[Rule],
    joint_rules: Iterable[JointRule],
    histories: Iterable[History],
    diagnostics: Diagnostics,
) -> None:
    """Check that no invariant depends on what a tool answers: nothing measures it at a control tick.

    Args:
        tools: tools by action kind.
        rules: the invariants.
        joint_rules: those about two actions.
        histories: conditions on past states that they use.
        diagnostics: receives the faults.
    """
    answers = {answer: kind for kind, tool in tools.items() for answer in tool.answers}
    past: dict[str, set[str]] = {}
    for history in histories:  # one may read those before it
        names = set(t.variables_of(history.term))
        past[history.declared.name] = names.union(*(past.get(name, ()) for name in names))
    terms: list[tuple[Rule | JointRule, t.Term]] = [
        (rule, term) for rule in rules for term in _terms_of(rule)
    ]
    terms += [(rule, rule.term) for rule in joint_rules]
    found: dict[tuple[str, str], Rule | JointRule] = {}
    for rule, term in terms:
        read = set(t.variables_of(term))
        read = read.union(*(past.get(name, ()) for name in read))
        found |= {(rule.id, answer): rule for answer in sorted(read & answers.keys())}
    for (_, answer), rule in found.items():
        headline = f"the invariant `{rule.id}` reads `{answer}`, which the tool `{answers[answer]}` answers"
        help_ = "use it in conditions of modules, or measure it with a sensor"
        diagnostics.error("AE137", headline, rule.require_span, help=(help_,))


def _terms_of(rule: Rule) -> Iterator[t.Term]:
    yield from rule.terms.values()
    for attenuation in rule.attenuations.values():
        yield from attenuation.values()


def _report(name: TextField, reason: str, diagnostics: Diagnostics) -> None:
    diagnostics.error("AE137", f"`{name.value}` is not a tool: {reason}", name.span)


def _service(
    name: TextField, tool: declared.Tool, diagnostics: Diagnostics
) -> HttpService | Program | McpService | None:
    given = [one for one in (tool.http, tool.program or None, tool.mcp) if one is not None]
    if len(given) != 1:
        _report(name, "it has one of `http`, `program` and `mcp`", diagnostics)
        return None
    token = None if tool.token is None else tool.token.value
    has_address = tool.http is not None or (tool.mcp is not None and tool.mcp.url is not None)
    if tool.token is not None and not (has_address and _VARIABLE.fullmatch(tool.token.value)):
        cure = "`token` names an environment variable, as in `COOKBOOK_TOKEN`, for a service with an address"
        diagnostics.error("AE137", cure, tool.token.span)
        return None
    if tool.confinement is not None and has_address:
        headline = "`confinement` is of a program that AEROS starts, and this service has an address"
        diagnostics.error("AE137", headline, tool.confinement.span)
        return None
    if tool.http is not None:
        return HttpService(tool.http.value, token) if _is_safe_url(tool.http, diagnostics) else None
    confinement = _confinement(tool.confinement, diagnostics)
    if tool.mcp is None:
        _check_program(tool.program[0], diagnostics)
        return Program(tuple(one.value for one in tool.program), confinement)
    server = tool.mcp
    if (server.url is None) == (not server.command):
        _report(name, "its MCP server has either `command` or `url`", diagnostics)
        return None
    if server.url is not None and not _is_safe_url(server.url, diagnostics):
        return None
    if server.command:
        _check_program(server.command[0], diagnostics)
    command = tuple(one.value for one in server.command)
    url = "" if server.url is None else server.url.value
    return McpService(server.tool.value, command, url, token, confinement)


def _check_program(program: TextField, diagnostics: Diagnostics) -> None:
    """Check that a program is a plain name, or the same file from wherever the runtime is started."""
    if "/" in program.value:
        _check_absolute(program, "/usr/bin/ask", diagnostics)


def _check_absolute(path: TextField, example: str, diagnostics: Diagnostics) -> bool:
    """Check that a path is absolute and has no `..`; report it otherwise."""
    if path.value.startswith("/") and os.path.normpath(path.value) == path.value:
        return True
    headline = f"`{path.value}` is not an absolute path without `..`"
    diagnostics.error("AE137", headline, path.span, help=(f"write it like `{example}`",))
    return False


def _confinement(confinement: declared.Confinement | None, diagnostics: Diagnostics) -> Confinement:
    usual = Confinement()
    if confinement is None:
        return usual
    for path in (*confinement.reads, *confinement.writes):
        if not _check_absolute(path, "/opt/recipes", diagnostics):
            continue
        if PurePath(_TEMPORARY).is_relative_to(path.value):
            headline = f"`{path.value}` contains temporary files of the runtime and of other programs"
            help_ = (
                "name the folders that it needs, such as `/opt/recipes`; it has one of its own in `TMPDIR`"
            )
            diagnostics.error("AE137", headline, path.span, help=(help_,))
    memory, processor = usual.memory, usual.processor
    if confinement.memory is not None:
        memory = elaborate_memory(confinement.memory, diagnostics) or memory
    if confinement.processor is not None:
        share = elaborate_processor_share(confinement.processor, Fraction(1), diagnostics)
        processor = share or processor
    return Confinement(
        tuple(path.value for path in confinement.reads),
        tuple(path.value for path in confinement.writes),
        confinement.network is not None and confinement.network.value,
        memory,
        processor,
        usual.processes if confinement.processes is None else confinement.processes.value,
    )


def _is_safe_url(url: TextField, diagnostics: Diagnostics) -> bool:
    """Check that an address is of HTTP, is encrypted unless it is on this machine, and holds no password."""
    try:
        parts = urlsplit(url.value)
        host, _ = parts.hostname, parts.port
    except ValueError:
        host = None
    is_plain = url.value.isascii() and url.value.isprintable() and " " not in url.value
    if not is_plain or host is None or parts.scheme not in ("http", "https") or "@" in parts.netloc:
        diagnostics.error("AE137", f"`{url.value}` is not an address of HTTP without a password", url.span)
        return False
    if parts.scheme == "http" and host not in _LOCAL:
        headline = f"`{url.value}` is not on this machine, and anybody on the way could change its answers"
        diagnostics.error("AE137", headline, url.span, help=("use `https`",))
        return False
    return True
