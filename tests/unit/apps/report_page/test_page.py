"""The page about a run needs no other file, and texts of modules on it stay text."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
import subprocess
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.report_page.film_element import FilmFile
from aeros.apps.report_page.page import page_of
from aeros.apps.report_page.run_data import read_run_data
from aeros.runtime.audit.log import verify_log
from aeros.sim.film.film_span import FilmSpan
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.apps.report_page.left_runs import copied_run, decision, written_run
from tests.unit.sim.film.mp4_boxes import film_bytes

HOSTILE = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</script><script>alert(1)</script>",
    "</title></style><svg onload=alert(1)>",
    "' onmouseover='alert(1)",
    "<!--",
    "&lt;b&gt;\x1b[31m\u202e",
)


class _Elements(HTMLParser):
    """Every element and attribute of a page, and the text of its scripts."""

    def __init__(self) -> None:
        super().__init__()
        self.attributes: list[tuple[str, str, str]] = []
        self.tags: list[str] = []
        self.scripts: list[str] = []
        self.text: list[str] = []
        self._in_script = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self._in_script = tag == "script"

    def handle_endtag(self, tag: str) -> None:
        self._in_script = False

    def handle_data(self, data: str) -> None:
        (self.scripts if self._in_script else self.text).append(data)


def elements(page: str) -> _Elements:
    found = _Elements()
    found.feed(page)
    found.close()
    return found


def hostile_run(folder: Path, text: str) -> str:
    noted: dict[str, Any] = {"instruction": text, "task": text}
    records: list[tuple[str, dict[str, Any]]] = [
        ("note", {"event": "task-selected", "details": noted}),
        ("note", {"event": "plan-accepted", "details": {"steps": [text, {text: text}]}}),
        ("step-began", {"module": "arm", "skill": text, "time": 0.0}),
        ("decision", decision(0.5, "DENY", text, reasons=[["AE750", text, text], [text, text, text], text])),
        ("decision", decision(0.6, "ATTENUATE", text, asked={"kind": text, "parameters": {text: text}})),
        ("step-ended", {"module": "arm", "skill": text, "time": 1.0, "status": text, "reason": text}),
        ("note", {"event": "step-ended", "details": {"skill": f"arm.{text}", "role": text, "outcome": text}}),
        ("note", {"event": "run-ended", "details": {"reason": text, "measured": {text: 1}}}),
        ("configuration-changed", {"configuration": text, "site": {"id": text, "digest": text},
                                   "modules": {text: {"version": text, "manifest": text, "code": text}}}),
    ]  # fmt: skip
    trace = [
        {"time": 0.0, "kind": "task-selected", "text": text, "details": noted},
        {"time": 0.2, "kind": "plan-accepted", "text": text, "details": {"steps": [text, {text: text}]}},
        {"time": 0.7, "kind": "fault-started", "text": text, "details": {}},
        {"time": 0.8, "kind": "replan", "text": text, "details": {}},
    ]
    out = written_run(folder, records, trace)
    return page_of(read_run_data(out), text, {}, text)


@pytest.mark.parametrize("text", HOSTILE)
def test_text_of_a_module_stays_text(text: str, tmp_path: Path) -> None:
    harmless = elements(hostile_run(tmp_path / "harmless", re.sub(r"\S", "x", text)))
    found = elements(hostile_run(tmp_path / "hostile", text))
    assert found.tags == harmless.tags
    assert [one[:2] for one in found.attributes] == [one[:2] for one in harmless.attributes]
    assert found.scripts == harmless.scripts


def test_a_page_refers_to_nothing_outside_itself(tmp_path: Path) -> None:
    out = copied_run(tmp_path, "--report")
    page = (out / "report.html").read_text()
    found = elements(page)
    assert not {"link", "iframe", "object", "embed", "img", "base"} & set(found.tags)
    targets = [one[2] for one in found.attributes if one[1] in ("src", "href", "action", "formaction")]
    names = {f"#{one[2]}" for one in found.attributes if one[1] == "id"}
    assert set(targets) <= names
    assert not [one for one in found.attributes if one[1].startswith("on") or one[1] == "style"]
    assert re.findall(r"url\((?!#head\))", page) == []
    assert re.findall(r"https?://(?!www\.w3\.org/2000/svg)", page) == []


def policy_of(found: Any) -> str:
    (policy,) = [
        value
        for tag, name, value in found.attributes
        if tag == "meta" and name == "content" and value.startswith("default-src")
    ]
    return str(policy)


def test_no_script_may_run_but_its_own(tmp_path: Path) -> None:
    found = elements(hostile_run(tmp_path / "out", HOSTILE[0]))
    policy = policy_of(found)
    (script,) = found.scripts
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy == f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"


def test_a_run_is_reported_whole(tmp_path: Path) -> None:
    out = copied_run(tmp_path, "--report")
    allowed = verify_log(out / "audit.jsonl").decisions.allowed
    text = " ".join(elements((out / "report.html").read_text()).text)
    for message in (
        "goal reached", "make_dumplings.prepare", "2 times, 1 failed", "re-plan 1: `make_dumplings.prepare`",
        "sound", f"{allowed} allowed, 0 attenuated, 0 denied", "human_distance", "arm-separation", "× ALLOW",
    ):  # fmt: skip
        assert message in text, message
    head = json.loads((out / "audit.jsonl").read_text().splitlines()[-1])["hash"]
    assert head in text


def test_a_denial_is_reported_with_its_reasons(tmp_path: Path) -> None:
    reasons = [["AE750", "arm-standing", "somebody is so near"], ["AE730", "envelope", "outside"]]
    records = [("decision", decision(0.5, "DENY", reasons=reasons))]
    page = page_of(read_run_data(written_run(tmp_path / "out", records)), "r", {}, "")
    text = "".join(elements(page).text)
    assert "AE750 arm-standing: somebody is so near" in text
    assert "AE730 envelope: outside" in text
    assert "No bounds are drawn under sites that are not available: " + "0" * 64 in text


def test_a_task_that_has_no_end_does_not_get_that_of_the_one_before(tmp_path: Path) -> None:
    selected = {"event": "task-selected", "details": {"instruction": "do this, then that"}}
    notes = [selected, {"event": "run-ended", "details": {"reached": True}}, selected]
    for count, shown in ((2, "goal reached"), (3, "no end is recorded")):
        out = written_run(tmp_path / str(count), [("note", one) for one in notes[:count]])
        page = page_of(read_run_data(out), "r", {}, "")
        (headline,) = re.findall("<h1>.*</h1>", page)
        assert f"do this, then that: {shown}" in re.sub("<.*?>", "", headline)


def test_a_quantity_that_broke_a_rule_all_the_time_is_not_folded(tmp_path: Path) -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    session = {"configuration": "s", "site": {"id": "cell", "digest": site.digest}, "modules": {}}
    asked = {"kind": "move_tool", "parameters": {"target": [0.5, 0.0, 0.3], "yaw": 0.0, "speed": 0.1}}
    for distance, is_folded in ((0.2, False), (3.0, True)):
        state = {"human_distance": [distance, 1.0]}
        decided = decision(1.0, asked=asked, decided=asked, configuration="s", state=state)
        records = [("configuration-changed", session), ("decision", decided)]
        left = read_run_data(written_run(tmp_path / str(is_folded), records))
        page = page_of(left, "r", {site.digest: site}, "")
        folded = " ".join(re.findall("<summary>without a change: .*?</summary>", page))
        assert ("human_distance" in folded) is is_folded


def test_records_after_a_broken_link_are_not_shown(tmp_path: Path) -> None:
    out = written_run(tmp_path / "out", [("decision", decision(time)) for time in (1.0, 2.0, 3.0)])
    log = out / "audit.jsonl"
    log.write_text(log.read_text().replace('"time":2.0', '"time":2.5'))
    left = read_run_data(out)
    assert [one.time for one in left.decisions] == [1.0]
    page = page_of(left, "r", {}, "")
    assert "NOT SOUND: record 2 was edited" in "".join(elements(page).text)
    (headline,) = re.findall("<h1>.*</h1>", page)
    assert headline.startswith('<h1><span class="bad">audit chain NOT SOUND</span>')


def linked_page(folder: Path, span: FilmSpan, name: str = "film.mp4") -> _Elements:
    records: list[tuple[str, dict[str, Any]]] = [
        ("step-began", {"module": "arm", "skill": "reach", "time": 2.0}),
        ("decision", decision(3.0, "DENY", reasons=[["AE750", "arm-standing", "near"]])),
        ("decision", decision(5.0)),
        ("step-ended", {"module": "arm", "skill": "reach", "time": 6.0, "status": "halted", "reason": "no"}),
    ]
    run = read_run_data(written_run(folder, records))
    return elements(page_of(run, "r", {}, "", FilmFile(name, film_bytes(span.comment()))))


def test_steps_marks_and_decisions_are_linked_to_a_film_that_shows_them(tmp_path: Path) -> None:
    found = linked_page(tmp_path / "out", FilmSpan(0.0, 10.0, 4.0))
    linked = [(tag, value) for tag, name, value in found.attributes if name == "data-time"]
    assert linked == [
        ("rect", "2.000"), ("g", "3.000"), ("g", "6.000"), ("span", "3.000"), ("span", "6.000"),
        ("span", "3.000"), ("span", "5.000"),
    ]  # fmt: skip
    film = {
        name: value for tag, name, value in found.attributes if tag == "video" and name.startswith("data")
    }
    assert film == {"data-start": "0.0", "data-end": "10.0", "data-speed": "4.0"}
    assert ("path", "id", "cursor") in found.attributes
    policy = policy_of(found)
    (script,) = found.scripts
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy == (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; "
        "media-src data:; img-src data:"
    )
    assert "requestAnimationFrame" in script
    # Before the script runs, nothing looks as if it could be pressed.
    assert not [one for one in found.attributes if one[1] in ("tabindex", "role") and one[2] == "button"]


def test_only_what_a_film_shows_is_linked_to_it(tmp_path: Path) -> None:
    part = linked_page(tmp_path / "part", FilmSpan(2.5, 5.5, 1.0))
    assert {value for _, name, value in part.attributes if name == "data-time"} == {"3.000", "5.000"}
    picture = linked_page(tmp_path / "picture", FilmSpan(0.0, 10.0, 1.0), "film.gif")
    assert not [one for one in picture.attributes if one[1].startswith("data-time") or one[2] == "cursor"]
    assert "sets the film there" not in " ".join(picture.text)
    assert "requestAnimationFrame" not in picture.scripts[0]


CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None
)


@pytest.mark.deep
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_a_browser_has_nothing_to_complain_of(tmp_path: Path) -> None:
    page = copied_run(tmp_path, "--report") / "report.html"
    done = subprocess.run(
        [
            str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0",
            "--virtual-time-budget=5000", "--dump-dom", page.as_uri(),
        ],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert "goal reached" in done.stdout
    assert "CONSOLE" not in done.stderr
    # Its script has run: the filter is there.
    assert re.search(r'<form id="filter">', done.stdout)


@contextmanager
def narrow_browser(profile: Path) -> Iterator[Callable[[str, dict[str, Any]], dict[str, Any]]]:
    """Chromium with a screen of 390 pixels, which is given commands of its DevTools protocol."""
    from websockets.sync.client import connect

    command = [
        *(str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"),
        *(f"--user-data-dir={profile}", "about:blank"),
    ]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as browser:
        try:
            assert browser.stderr is not None
            started = (re.search(r"listening on ws://([^/]+)/", line) for line in browser.stderr)
            address = next(one[1] for one in started if one is not None)
            with urllib.request.urlopen(f"http://{address}/json", timeout=60) as pages:
                target = next(one for one in json.load(pages) if one["type"] == "page")
            with connect(target["webSocketDebuggerUrl"], max_size=None) as socket:

                def ask(method: str, parameters: dict[str, Any]) -> dict[str, Any]:
                    socket.send(json.dumps({"id": 1, "method": method, "params": parameters}))
                    while (answer := json.loads(socket.recv(60.0))).get("id") != 1:
                        pass
                    found: dict[str, Any] = answer["result"]
                    return found

                screen = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": False}
                ask("Emulation.setDeviceMetricsOverride", screen)
                yield ask
        finally:
            browser.kill()


@pytest.mark.deep
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_a_telephone_need_not_scroll_sideways(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    run = read_run_data(Path(__file__).parents[1] / "data" / "run_with_a_person")
    # Its site is not there, so the page has a digest in a sentence.
    page.write_text(page_of(run, "run", {}, "not checked"), encoding="utf-8")
    with narrow_browser(tmp_path / "profile") as ask:
        ask("Page.navigate", {"url": page.as_uri()})
        script = "document.readyState + document.querySelectorAll('footer').length"
        while ask("Runtime.evaluate", {"expression": script})["result"]["value"] != "complete1":
            pass
        width = {"expression": "document.documentElement.scrollWidth"}
        assert 300 < ask("Runtime.evaluate", width)["result"]["value"] <= 390
