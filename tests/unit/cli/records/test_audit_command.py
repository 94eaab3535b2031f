from __future__ import annotations

import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.check import GENESIS
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import seal_record, to_canonical_json
from aeros.runtime.records.records import DecisionRecord, decision_details, session_details
from tests.unit.runtime import bench

REPOSITORY = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a signed and anchored run on the symbolic plant has taken place."""
    folder = tmp_path_factory.mktemp("ran")
    assert main(["audit", "keygen", "--out", str(folder / "key")]) == Exit.SUCCESS
    code = main(
        ["run", "make dumplings", "--ecms", str(REPOSITORY / "ecms"), "--plant", "symbolic", "--seed", "7",
         "--state", str(folder / "state"), "--out", str(folder / "out"), "--audit-key", str(folder / "key"),
         "--anchor", str(folder / "anchor")]
    )  # fmt: skip
    assert code == Exit.SUCCESS
    return folder


@pytest.fixture
def folder(ran: Path, tmp_path: Path) -> Path:
    """A copy of it, to be tampered with."""
    return Path(shutil.copytree(ran, tmp_path / "ran"))


def lines_of(folder: Path) -> list[bytes]:
    return (folder / "out" / "audit.jsonl").read_bytes().splitlines(keepends=True)


def audit(command: str, folder: Path, *options: str) -> int:
    return main(["audit", command, str(folder / "out" / "audit.jsonl"), *options])


def decisions_in(folder: Path) -> int:
    """Return the number of decisions in the log of the run, and check that there are some."""
    count = [json.loads(line)["event"] for line in lines_of(folder)].count("decision")
    assert count > 100
    return count


def with_key(folder: Path) -> tuple[str, str]:
    return "--public-key", str(folder / "key.pub")


def with_anchor(folder: Path) -> tuple[str, ...]:
    return (*with_key(folder), "--anchor", str(folder / "anchor"))


# verify


def test_verify_says_what_it_checked_and_what_nobody_could_notice(
    ran: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    count = len(lines_of(ran))
    assert audit("verify", ran) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert (
        f"chain        sound, {count} records: {decisions_in(ran)} allowed, 0 attenuated, 0 denied" in message
    )
    unchecked = r"^signatures   not checked: no --public-key, though \d+ checkpoints are in the log$"
    assert re.search(unchecked, message, re.MULTILINE)
    assert "NOT CHECKED  records removed at the end\n" in message
    assert audit("verify", ran, *with_key(ran)) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert f"signatures   sound, of the first {count} records; the log is closed by its writer" in message
    assert "NOT CHECKED  records removed right after an earlier checkpoint\n" in message
    assert audit("verify", ran, *with_anchor(ran)) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert f"anchor       the first {count} records are all there" in message
    assert message.count("NOT CHECKED") == 1
    assert "NOT CHECKED  an earlier log and its anchor put back together" in message
    assert audit("verify", ran, *with_anchor(ran), "--anchor", str(ran / "anchor")) == Exit.SUCCESS
    assert "NOT CHECKED" not in capsys.readouterr().out


def rewritten(folder: Path) -> None:
    lines, previous = [], GENESIS
    for record in map(json.loads, lines_of(folder)):
        body = {**record, "previous": previous, "written": 1.5}
        del body["hash"]
        line, previous = seal_record(to_canonical_json(body))
        lines.append(line)
    (folder / "out" / "audit.jsonl").write_bytes(b"".join(lines))


def edited(folder: Path) -> None:
    lines = lines_of(folder)
    lines[9] = lines[9].replace(b'"ALLOW"', b'"DENY"')
    (folder / "out" / "audit.jsonl").write_bytes(b"".join(lines))


def shortened(folder: Path) -> None:
    lines = lines_of(folder)
    del lines[9]
    (folder / "out" / "audit.jsonl").write_bytes(b"".join(lines))


def cut(folder: Path) -> None:
    """After the second checkpoint."""
    lines = lines_of(folder)
    places = [place for place, line in enumerate(lines) if b'"event":"checkpoint"' in line]
    (folder / "out" / "audit.jsonl").write_bytes(b"".join(lines[: places[1] + 1]))


@pytest.mark.parametrize(
    ("tamper", "alone", "key", "anchor"),
    [
        (edited, "record 9 was edited", "record 9 was edited", "record 9 was edited"),
        (shortened, "record 9 is missing", "record 9 is missing", "record 9 is missing"),
        (
            rewritten,
            "",
            "the checkpoint in record 1 was signed for other records",
            "the anchor is of another log",
        ),
        (cut, "", "", "the log was cut: it ends before record"),
    ],
)
def test_verify_finds_what_it_says_it_finds(
    tamper: Any, alone: str, key: str, anchor: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tamper(folder)
    for options, why in (((), alone), (with_key(folder), key), (with_anchor(folder), anchor)):
        assert audit("verify", folder, *options) == (Exit.REJECTED if why else Exit.SUCCESS)
        assert f"NOT SOUND: {why}" in capsys.readouterr().out or not why
        assert audit("verify", folder, *options, "--format", "json") in (Exit.SUCCESS, Exit.REJECTED)
        report = json.loads(capsys.readouterr().out)
        assert report["sound"] == (not why)
        assert report["log"].endswith(".jsonl")
        assert why in report["why"]


def test_verify_says_how_much_of_a_log_that_was_not_closed_is_vouched_for(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "out" / "audit.jsonl").write_bytes(b"".join(lines_of(folder)[:10]))
    assert audit("verify", folder, *with_key(folder)) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert (
        "sound, of the first 2 records; the log is not closed: the writer is still running or was killed"
        in message
    )
    assert "NOT CHECKED  changes after the newest checkpoint, which 8 records follow now" in message


def test_verify_refuses_an_anchor_without_a_key_and_what_is_no_key(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert audit("verify", folder, "--anchor", str(folder / "anchor")) == Exit.USAGE
    assert "--anchor needs --public-key" in capsys.readouterr().err
    assert audit("verify", folder, "--public-key", str(folder / "anchor")) == Exit.REJECTED
    assert "is not a public key" in capsys.readouterr().err
    (folder / "anchor").write_text("{}")
    assert audit("verify", folder, *with_anchor(folder)) == Exit.REJECTED
    assert "is not an anchor" in capsys.readouterr().err


# run


def run(folder: Path, *options: str) -> int:
    return main(
        ["run", "make dumplings", "--ecms", str(REPOSITORY / "ecms"), "--plant", "symbolic",
         "--state", str(folder / "state"), "--out", str(folder / "again"), *options]
    )  # fmt: skip


def test_a_key_in_the_agents_folder_is_used_unasked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(folder / "key", folder / "state" / "audit.key")
    assert run(folder) == Exit.SUCCESS
    assert "chain sound, signed and anchored\n" in capsys.readouterr().out
    options = ("--state", str(folder / "state"), "--closed")
    log = folder / "again" / "audit.jsonl"
    assert main(["audit", "verify", str(log), *options]) == Exit.SUCCESS
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:2]))
    assert main(["audit", "verify", str(log), *options]) == Exit.REJECTED
    assert "the log was cut" in capsys.readouterr().out


def test_a_run_can_be_left_unsigned(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "--unsigned") == Exit.SUCCESS
    assert "chain sound\n" in capsys.readouterr().out
    assert run(folder, "--unsigned", "--anchor", str(folder / "new")) == Exit.USAGE
    assert "--unsigned cannot be combined" in capsys.readouterr().err


def test_closed_rejects_a_log_with_an_unsigned_end(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit("verify", folder, *with_key(folder), "--closed") == Exit.SUCCESS
    assert audit("verify", folder, "--closed") == Exit.USAGE
    (folder / "out" / "audit.jsonl").write_bytes(b"".join(lines_of(folder)[:10]))
    assert audit("verify", folder, *with_key(folder)) == Exit.SUCCESS
    assert audit("verify", folder, *with_key(folder), "--closed") == Exit.REJECTED
    assert "its end is not signed" in capsys.readouterr().out


def test_a_run_neither_overwrites_the_anchor_of_another_nor_starts_with_a_key_it_cannot_use(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "anchor").read_bytes()
    key = ("--audit-key", str(folder / "key"))
    assert run(folder, *key, "--anchor", str(folder / "anchor")) == Exit.REJECTED
    assert "each log has its own anchor" in capsys.readouterr().err
    assert (folder / "anchor").read_bytes() == before
    (folder / "key").chmod(0o644)
    assert run(folder, *key) == Exit.REJECTED
    assert "is accessible to other users" in capsys.readouterr().err


def test_keygen_never_overwrites_a_key(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["audit", "keygen", "--out", str(folder / "key")]) == Exit.REJECTED
    assert "exists already" in capsys.readouterr().err


# show


@pytest.fixture
def decided(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log of decisions of every sort."""
    monkeypatch.setattr(os, "fdatasync", lambda file: None)
    path = tmp_path / "out" / "audit.jsonl"
    path.parent.mkdir()
    asked = [
        bench.request(),
        bench.request(human_distance=0.25),
        bench.request(speed=1.0),
        bench.request("quickly", "sweep", wind=5.0, pace=3.0),
        *(replace(bench.request("quickly", "carry"), usage={"carry-rate": used}) for used in range(4)),
        replace(bench.without(bench.request(), "stop_pressed"), usage={"carry-rate": 3}),
    ]
    with AuditLog(path, clock=iter(range(1_000_000, 2_000_000)).__next__) as log:
        log.append("session-opened", session_details(bench.configuration()))
        for one in asked:
            decision, digest = one.decided_by(bench.gate()), bench.configuration().digest
            made = DecisionRecord(decision, digest, one.now, one.readings, one.caller, one.action, one.usage)
            log.append("decision", decision_details(made))
        log.append("step-ended", {"module": "handling", "skill": "slowly", "status": "denied", "reason": "r"})
        log.append("note", {"event": "plan\x1b[2J"})
    return tmp_path


def shown(folder: Path, capsys: pytest.CaptureFixture[str], *options: str) -> list[int]:
    assert audit("show", folder, *options, "--format", "json") == Exit.SUCCESS
    return [json.loads(line)["sequence"] for line in capsys.readouterr().out.splitlines()]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]),
        (("--decision", "DENY"), [2, 3, 8, 9]),
        (("--decision", "ALLOW", "--decision", "ATTENUATE"), [1, 4, 5, 6, 7]),
        (("--kind", "move"), [1, 2, 3, 9]),
        (("--rule", "separation"), [2]),
        (("--rule", "AE742", "--rule", "top-speed"), [3, 8]),
        (("--skill", "slowly"), [10]),
        (("--skill", "handling.quickly", "--from-record", "3", "--to-record", "5"), [3, 4, 5]),
        (("--module", "unheard_of"), []),
        (("--event", "note", "--event", "session-opened"), [0, 11]),
        (("--since", "1970-01-12T13:46:41+00:00", "--until", "1970-01-12T13:46:43+00:00"), [1, 2, 3]),
    ],
)
def test_show_shows_what_was_asked_for(
    options: tuple[str, ...], expected: list[int], decided: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert shown(decided, capsys, *options) == expected


def test_show_says_why_in_words(decided: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit("show", decided, "--site", str(bench.SITE)) == Exit.SUCCESS
    message = capsys.readouterr().out
    for words in (
        "DENY       handling.quickly asks for move(speed=0.0625, target=[0.25, 0.125, 0.25]) at 100.000 s",
        "AE750 separation: breaks `human_distance >= 500 mm`: nobody is within reach",
        "AE750 means: the action breaks an invariant",
        "bench.yaml:64:14, and comes from: risk assessment",
        "`human_distance` was 0.25 m, measured 0 s before",
        "requested `speed` = 1 m/s",
        "AE742 carry-rate: the quota `carry-rate` of 3 is used up",
        "of 3 actions within 60 s, 3 had been executed",
        "AE703 stop_pressed: `stop_pressed` is not measured",
        "`stop_pressed` was not measured",
        'attenuated to sweep(pace=1.0, tool="knife", wet=true)',
        "handling.slowly: denied: r",
        r"note            plan\x1b[2J",
    ):
        assert words in message


def test_show_says_that_another_site_governed(decided: Path, capsys: pytest.CaptureFixture[str]) -> None:
    site = str(REPOSITORY / "tests" / "corpus" / "site" / "table.yaml")
    assert audit("show", decided, "--site", site) == Exit.SUCCESS
    assert "record 0 opens a session under a different site file" in capsys.readouterr().err


def test_show_accepts_every_content_of_a_sound_chain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").mkdir()
    strange: list[dict[str, Any]] = [
        {"verdict": "DENY"},
        {"verdict": "DENY", "reasons": 1, "asked": 1},
        {
            "verdict": "DENY",
            "reasons": [1, ["AE000", [], {}], ["AE750", "separation", ""]],
            "asked": {"kind": []},
        },
        {
            "verdict": "DENY",
            "reasons": [["AE706", "dirt", ""], ["AE742", "carry-rate", ""]],
            "state": {"dirt": 1},
        },
        {"verdict": "ATTENUATE", "reasons": [["AE750", "separation", ""]], "module": [], "skill": {}},
    ]
    with AuditLog(tmp_path / "out" / "audit.jsonl", clock=lambda: 1e300) as log:
        for one in strange:
            log.append("decision", one)
    for options in ((), ("--format", "json"), ("--skill", "x", "--kind", "y", "--rule", "z")):
        assert audit("show", tmp_path, "--site", str(bench.SITE), *options) == Exit.SUCCESS
    assert "at no time" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["show", "replay"])
def test_an_unsound_log_is_read_up_to_where_it_is_sound(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edited(folder)
    options = ("--ecms", str(REPOSITORY / "ecms")) if command == "replay" else ()
    assert audit(command, folder, *options) == Exit.REJECTED
    assert (
        "the log is not sound and was read only up to there: record 9 was edited" in capsys.readouterr().err
    )


# replay


@pytest.mark.parametrize("gate", ["compiled", "checked"])
def test_a_run_is_decided_the_same_again(gate: str, ran: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit("replay", ran, "--ecms", str(REPOSITORY / "ecms"), "--gate", gate) == Exit.SUCCESS
    assert f"{decisions_in(ran)} decisions reproduced; 0 differ" in capsys.readouterr().out


def test_replay_names_what_does_not_come_out_the_same(
    decided: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = ("--site", str(bench.SITE), "--ecms", str(bench.MODULE))
    assert audit("replay", decided, *own) == Exit.SUCCESS
    assert "9 decisions reproduced" in capsys.readouterr().out
    path = decided / "out" / "audit.jsonl"
    opened, record = map(json.loads, path.read_bytes().splitlines()[:2])
    path.unlink()
    with AuditLog(path) as log:
        log.append("session-opened", opened["details"])
        log.append("decision", {**record["details"], "verdict": "DENY"})
    assert audit("replay", decided, *own) == Exit.REJECTED
    message = capsys.readouterr().out
    assert "record 1 is not reproduced" in message
    assert '"verdict": "DENY"' in message
    assert '"verdict": "ALLOW"' in message
    assert audit("replay", decided, *own, "--format", "json") == Exit.REJECTED
    assert json.loads(capsys.readouterr().out)["disagreements"][0]["sequence"] == 1


def test_replay_takes_what_was_in_force_on_this_robot(
    decided: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = ("--state", str(tmp_path / "state"))
    changes = [
        ("policy", str(bench.SITE)),
        ("install", str(bench.MODULE)),
        ("configure", "handling"),
        ("activate", "handling"),
    ]
    for change in changes:
        assert main([*change, *state]) == Exit.SUCCESS, capsys.readouterr().err
    assert audit("replay", decided, *state) == Exit.SUCCESS
    assert "9 decisions reproduced" in capsys.readouterr().out
    for verb in ("deactivate", "remove"):
        assert main([verb, "handling", *state]) == Exit.SUCCESS
    assert audit("replay", decided, *state) == Exit.SUCCESS
    shutil.rmtree(tmp_path / "state" / "registry" / "modules")
    capsys.readouterr()
    assert audit("replay", decided, *state) == Exit.REJECTED
    message = capsys.readouterr().out
    assert "parts of it are no longer stored: `handling` 1.0.0 sha256:" in message
    assert "0 decisions reproduced; 9 differ" in message


def test_replay_requires_the_same_configuration(decided: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit("replay", decided, "--ecms", str(REPOSITORY / "ecms" / "clean_table")) == Exit.REJECTED
    message = capsys.readouterr().out
    assert "record 1 cannot be replayed: it was decided under the configuration" in message
    assert "0 decisions reproduced; 9 differ" in message


@pytest.mark.parametrize("command", ["", "verify", "show", "replay", "keygen"])
def test_each_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["audit", *([command] if command else []), "--help"])
    assert ended.value.code == 0
    message = capsys.readouterr().out
    assert "examples:\n" in message
    assert "exit codes:" in message
