"""Tools of a site: services that could be relied on, and answers that no invariant reads."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.model.tools import Confinement, HttpService, McpService, Program, Tool
from tests.unit.spec.faults import TABLE, messages_of_site

STATE = (
    "  fetched: {",
    "  recipe: {type: real, unit: s, range: [0, 60], sensor: ask, max_age: 9 s}\n  fetched: {",
)
HTTP = "{http: http://127.0.0.1:8080/time, timeout: 2 s, answers: [recipe]}"
RULE = "require: not stop_pressed"


def kind(tool: str, more: str = "") -> tuple[str, str]:
    return (
        "actions:\n  stop:",
        f"actions:\n  ask:\n    description: ask\n    risk: low\n    tool: {tool}\n{more}  stop:",
    )


@pytest.mark.parametrize(
    ("tool", "service"),
    [
        (HTTP, HttpService("http://127.0.0.1:8080/time")),
        (
            "{http: 'https://cook.example/t', token: COOK, timeout: 2 s, answers: [recipe]}",
            HttpService("https://cook.example/t", "COOK"),
        ),
        (
            "{program: [/usr/bin/ask, --time], timeout: 2 s, answers: [recipe]}",
            Program(("/usr/bin/ask", "--time")),
        ),
        (
            "{program: [ask], confinement: {reads: [/opt/a], writes: [/var/b], network: true, memory: 1 GiB, "
            "processor: 50 %, processes: 4}, timeout: 2 s, answers: [recipe]}",
            Program(("ask",), Confinement(("/opt/a",), ("/var/b",), True, 2**30, Fraction(1, 2), 4)),
        ),
        (
            "{mcp: {tool: time, command: [cook]}, confinement: {}, timeout: 2 s, answers: [recipe]}",
            McpService("time", ("cook",)),
        ),
        (
            "{mcp: {tool: time, command: [cook, serve]}, timeout: 2 s, answers: [recipe]}",
            McpService("time", ("cook", "serve")),
        ),
        (
            "{mcp: {tool: time, url: 'http://localhost/mcp'}, token: T, timeout: 2 s, answers: [recipe]}",
            McpService("time", (), "http://localhost/mcp", "T"),
        ),
    ],
)
def test_a_tool_is_one_service(
    tmp_path: Path, tool: str, service: HttpService | Program | McpService
) -> None:
    text = TABLE.read_text()
    for old, new in (STATE, kind(tool)):
        assert text.count(old) == 1
        text = text.replace(old, new)
    path = tmp_path / "site.yaml"
    path.write_text(text)
    sink = Diagnostics()
    site = load_site(path, sink)
    assert list(sink) == []
    assert site is not None
    assert site.kinds["ask"].tool == Tool(service, Fraction(2), ("recipe",))


@pytest.mark.parametrize(
    ("tool", "message"),
    [
        (
            "{program: [ask], confinement: {reads: [opt]}, timeout: 2 s, answers: [recipe]}",
            "`opt` is not an absolute path without `..`",
        ),
        (
            "{program: [ask], confinement: {writes: [/opt/../etc]}, timeout: 2 s, answers: [recipe]}",
            "`/opt/../etc` is not an absolute path without `..`",
        ),
        (
            "{program: [bin/ask], timeout: 2 s, answers: [recipe]}",
            "`bin/ask` is not an absolute path without `..`",
        ),
        (
            "{mcp: {tool: t, command: [./cook]}, timeout: 2 s, answers: [recipe]}",
            "`./cook` is not an absolute path without `..`",
        ),
        (
            "{program: [ask], confinement: {writes: [/tmp]}, timeout: 2 s, answers: [recipe]}",
            "`/tmp` contains temporary files of the runtime",
        ),
        (
            "{program: [ask], confinement: {reads: [/]}, timeout: 2 s, answers: [recipe]}",
            "`/` contains temporary files of the runtime",
        ),
        (
            "{program: [ask], confinement: {processor: 2}, timeout: 2 s, answers: [recipe]}",
            "a processor share is at least 1 % and at most 100 % here",
        ),
        (
            "{program: [ask], confinement: {memory: 1 TB}, timeout: 2 s, answers: [recipe]}",
            "`1 TB` is not an amount of memory",
        ),
        (
            "{http: 'https://a/', confinement: {network: true}, timeout: 2 s, answers: [recipe]}",
            "this service has an address",
        ),
        (
            "{mcp: {tool: t, url: 'https://a/'}, confinement: {}, timeout: 2 s, answers: [recipe]}",
            "this service has an address",
        ),
        ("{timeout: 2 s, answers: [recipe]}", "it has one of `http`, `program` and `mcp`"),
        (
            "{http: http://127.0.0.1/, program: [ask], timeout: 2 s, answers: [recipe]}",
            "it has one of `http`, `program` and `mcp`",
        ),
        ("{mcp: {tool: t}, timeout: 2 s, answers: [recipe]}", "either `command` or `url`"),
        (
            "{mcp: {tool: t, command: [a], url: 'http://localhost'}, timeout: 2 s, answers: [recipe]}",
            "either `command` or `url`",
        ),
        ("{http: 'http://cook.example/t', timeout: 2 s, answers: [recipe]}", "is not on this machine"),
        ("{mcp: {tool: t, url: 'http://10.0.0.1/'}, timeout: 2 s, answers: [recipe]}", "is not on this"),
        ("{http: 'ftp://localhost/', timeout: 2 s, answers: [recipe]}", "is not an address of HTTP"),
        ("{http: 'https://me:pw@localhost/', timeout: 2 s, answers: [recipe]}", "without a password"),
        ("{http: 'https://local host/', timeout: 2 s, answers: [recipe]}", "is not an address of HTTP"),
        ("{http: 'https://localhost:99999/', timeout: 2 s, answers: [recipe]}", "is not an address of HTTP"),
        ("{program: [ask], timeout: 0 s, answers: [recipe]}", "above 0 s and at most 60 s"),
        ("{program: [ask], timeout: 61 s, answers: [recipe]}", "above 0 s and at most 60 s"),
        ("{program: [ask], timeout: 2 N, answers: [recipe]}", "error[AE204]"),
        ("{program: [ask], timeout: 2 s, answers: [recipe, recipes]}", "error[AE122]"),
        ("{program: [ask], timeout: 2 s, answers: [recipe, load]}", "`load` is measured by `encoders`"),
        ("{program: [ask], timeout: 2 s, answers: []}", "no answer sets `recipe`"),
        ("{program: [ask], token: T, timeout: 2 s, answers: [recipe]}", "names an environment variable"),
        (
            "{http: 'https://a/', token: t-1, timeout: 2 s, answers: [recipe]}",
            "names an environment variable",
        ),
    ],
)
def test_a_tool_that_could_not_be_relied_on_is_refused(tmp_path: Path, tool: str, message: str) -> None:
    found = messages_of_site(tmp_path, STATE, kind(tool))
    assert any(message in one for one in found), found


def test_a_tool_moves_nothing(tmp_path: Path) -> None:
    found = messages_of_site(tmp_path, STATE, kind(HTTP, "    actuators: [arm]\n"))
    assert ["can move no actuator" in one for one in found] == [True]


@pytest.mark.parametrize(
    "condition",
    ["not stop_pressed and recipe < 50 s", "not stop_pressed and not once within 1 s recipe > 50 s"],
)
def test_no_invariant_reads_an_answer(tmp_path: Path, condition: str) -> None:
    found = messages_of_site(tmp_path, STATE, kind(HTTP), (RULE, f'require: "{condition}"'))
    assert [one for one in found if "the invariant `stop-button` reads `recipe`" in one], found


OVERLAY = """schema: aeros/overlay/1
base: {base}
actions:
  {tool}: {{description: ask, risk: low{what}}}
state:
  {answer}: {{type: real, unit: s, range: [0, 60], sensor: {sensor}, max_age: 9 s}}
"""
TOOL = ", tool: {program: [/usr/bin/ask], timeout: 2 s, answers: [recipe]}"


def overlay(
    tmp_path: Path, *, tool: str = "ask", answer: str = "recipe", what: str = TOOL, sensor: str = "ask"
) -> tuple[list[str], Site | None]:
    path = tmp_path / "overlay.yaml"
    path.write_text(OVERLAY.format(base=TABLE, tool=tool, answer=answer, what=what, sensor=sensor))
    sink = Diagnostics()
    site = load_site(path, sink)
    return [f"{one.code}: {one.headline}" for one in sink], site


def test_an_overlay_adds_a_tool_and_its_answers(tmp_path: Path) -> None:
    found, site = overlay(tmp_path)
    assert found == []
    assert site is not None
    assert site.kinds["ask"].tool == Tool(Program(("/usr/bin/ask",)), Fraction(2), ("recipe",))
    assert site.state["recipe"].sensor == "ask"


@pytest.mark.parametrize(
    ("changes", "headline"),
    [
        ({"what": ""}, "AE137: an overlay adds no actions but tools, and `ask` has no `tool`"),
        ({"tool": "wipe"}, "AE121: `wipe` is already an action kind of the site"),
        ({"tool": "camera"}, "AE121: `camera` is already a sensor of the site"),
        ({"answer": "table_tidy"}, "AE121: `table_tidy` is already a state variable of the site"),
        ({"sensor": "camera"}, "AE137: `recipe` is measured by `camera`, no tool of this overlay"),
    ],
)
def test_an_overlay_changes_no_word_of_the_site(
    tmp_path: Path, changes: dict[str, str], headline: str
) -> None:
    found, site = overlay(tmp_path, **changes)
    assert site is None
    assert headline in found


def overlay_of_objects(tmp_path: Path, name: str) -> tuple[list[str], Site | None]:
    path, below = tmp_path / "overlay.yaml", tmp_path / "below.yaml"
    line = "objects:\n  {}: {{words: [{}], cylinder: [3 cm, 8 cm], colour: [1, 0, 0]}}\n"
    below.write_text(f"schema: aeros/overlay/1\nbase: {TABLE}\n" + line.format("jar", "jar"))
    path.write_text("schema: aeros/overlay/1\nbase: below.yaml\n" + line.format(name, "cup"))
    sink = Diagnostics()
    site = load_site(path, sink)
    return [f"{one.code}: {one.headline}" for one in sink], site


def test_an_overlay_adds_a_kind_of_objects(tmp_path: Path) -> None:
    found, site = overlay_of_objects(tmp_path, "cup")
    assert found == []
    assert site is not None
    assert {"jar", "cup"} <= site.objects.keys()
    assert {"jar", "cup"} <= set(site.enums["objects"].members)


def test_an_overlay_does_not_change_an_object_below_it(tmp_path: Path) -> None:
    found, site = overlay_of_objects(tmp_path, "jar")
    assert site is None
    assert found == ["AE121: `jar` is already an object of the site"]


@pytest.mark.parametrize(
    ("name", "faults"),
    [("hand_is_up", []), ("lamp_lit", ["AE121: `lamp_lit` is already a definition of the site"])],
)
def test_an_overlay_adds_definitions_and_changes_none(name: str, faults: list[str], tmp_path: Path) -> None:
    path, below = tmp_path / "overlay.yaml", tmp_path / "below.yaml"
    definitions = "definitions: {{{}: not stop_pressed}}\n"
    below.write_text(f"schema: aeros/overlay/1\nbase: {TABLE}\n" + definitions.format("lamp_lit"))
    path.write_text("schema: aeros/overlay/1\nbase: below.yaml\n" + definitions.format(name))
    sink = Diagnostics()
    site = load_site(path, sink)
    assert [f"{one.code}: {one.headline}" for one in sink] == faults
    assert site is None or site.definitions.keys() == {"lamp_lit", name}
