"""`aeros decide` as a filter: one decision for each line, whatever the lines hold."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.cli.run import decide
from aeros.exit_codes import Exit
from aeros.runtime.gate.wire import MAX_LINE
from tests.unit.runtime.bench import MODULE, SITE, proved

BENCH = ["decide", "--site", str(SITE), "--ecm", str(MODULE)]
MODES = ["compiled", "z3", "checked"]


class Fed:
    """`aeros decide` of the bench with these lines at standard input."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch = monkeypatch
        self._capsys = capsys
        # Proved once for all tests; that the command itself proves is tested below.
        monkeypatch.setattr(decide, "prove_configuration", lambda *_, **__: proved())

    def run(self, raw: bytes, *arguments: str) -> list[Any]:
        self._monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(raw)))
        assert main([*BENCH, *arguments]) == Exit.SUCCESS
        captured = self._capsys.readouterr()
        assert captured.err == ""
        return [json.loads(line) for line in captured.out.splitlines()]

    def verdicts(self, lines: Iterable[bytes], *arguments: str) -> list[str]:
        decisions = self.run(b"".join(line + b"\n" for line in lines), *arguments)
        return [decision["verdict"] for decision in decisions]

    def examples(self, skill: str, mode: str = "compiled") -> list[bytes]:
        found = self.run(b"", "--skill", skill, "--gate", mode, "--print-examples")
        return [json.dumps(request).encode() for request in found]


@pytest.fixture
def fed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Fed:
    return Fed(monkeypatch, capsys)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("skill", "kinds"),
    [
        ("slowly", ["move", "carry", "stop"]),
        ("quickly", ["move", "carry", "sweep"]),
        ("paced", ["carry"]),
    ],
)
def test_examples_are_allowed_in_every_mode(fed: Fed, skill: str, kinds: list[str], mode: str) -> None:
    examples = fed.examples(skill, mode)
    assert [json.loads(one)["action"]["kind"] for one in examples] == kinds
    for other in MODES:
        assert fed.verdicts(examples, "--skill", skill, "--gate", other) == ["ALLOW"] * len(kinds)


@pytest.mark.parametrize("mode", MODES)
def test_each_line_gets_one_decision_in_its_turn(fed: Fed, mode: str) -> None:
    good = fed.examples("quickly")[0]
    bad = [
        b"",
        b"[]",
        b"{",
        b"\xff",
        b"\xef\xbb\xbf" + good,
        b"[" * 100_000,
        b"x" * (2 << 20),
        good.replace(b'"time"', b'"time": 1, "time"', 1),
        b'{"a": NaN}',
    ]
    lines = [good, *(line for one in bad for line in (one, good))]
    expected = ["ALLOW"] + ["DENY", "ALLOW"] * len(bad)
    assert fed.verdicts(lines, "--skill", "quickly", "--gate", mode) == expected


def test_a_last_line_without_an_end_is_decided(fed: Fed) -> None:
    good = fed.examples("quickly")[0]
    assert [one["verdict"] for one in fed.run(good, "--skill", "quickly")] == ["ALLOW"]
    assert [one["verdict"] for one in fed.run(good + b"\r\n\n", "--skill", "quickly")] == ["ALLOW", "DENY"]
    assert fed.run(b"", "--skill", "quickly") == []


def test_the_longest_line_is_read_and_one_byte_more_is_not(fed: Fed) -> None:
    good = fed.examples("quickly")[0]
    longest = good + b" " * (MAX_LINE - len(good))
    assert fed.verdicts([longest, longest + b" ", good], "--skill", "quickly") == ["ALLOW", "DENY", "ALLOW"]


def test_denials_and_attenuations_do_not_change_the_exit_code(fed: Fed) -> None:
    request = json.loads(fed.examples("quickly")[0])
    request["state"]["human_distance"]["value"] = 1.0
    request["state"]["fitted"]["value"] = "brush"
    request["action"]["parameters"]["speed"] = 0.5
    line = json.dumps(request).encode()
    (decision,) = fed.run(line, "--skill", "quickly")
    assert decision["verdict"] == "ATTENUATE"
    assert decision["action"]["parameters"]["speed"] == 0.25
    assert [reason["rule"] for reason in decision["reasons"]] == ["near-person"]
    assert fed.verdicts([line], "--skill", "slowly") == ["DENY"]


def test_a_module_that_is_not_proved_decides_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = (MODULE / "ecm.yaml").read_text()
    (tmp_path / "skills.py").write_text((MODULE / "skills.py").read_text())
    (tmp_path / "ecm.yaml").write_text(manifest.replace("carry: gait <= 10 mm/s", "carry: true"))
    code = main(["decide", "--site", str(SITE), "--ecm", str(tmp_path), "--skill", "slowly"])
    captured = capsys.readouterr()
    assert code == Exit.REJECTED
    assert captured.out == ""
    assert "AE501" in captured.err


@pytest.mark.parametrize("arguments", [["--site", "nowhere.yaml"], ["--ecm", "nowhere"]])
def test_files_that_are_not_there_are_usage_errors(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*BENCH, "--skill", "slowly", *arguments])
    assert ended.value.code == Exit.USAGE
    assert "nowhere" in capsys.readouterr().err


def test_an_unknown_skill_is_a_usage_error_that_names_the_known_ones(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([*BENCH, "--skill", "fast"]) == Exit.USAGE
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "`handling` has no skill `fast`; it has slowly, quickly, paced" in captured.err


def test_several_modules_are_a_usage_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "skills.py").write_text((MODULE / "skills.py").read_text())
        text = (MODULE / "ecm.yaml").read_text().replace("id: handling", f"id: {name}", 1)
        (tmp_path / name / "ecm.yaml").write_text(text)
    code = main(["decide", "--site", str(SITE), "--ecm", str(tmp_path), "--skill", "slowly"])
    assert code == Exit.USAGE
    assert "holds several modules" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["--ecm", "x"], ["--ecm", "x", "--skill", "y", "--gate", "fast"]])
def test_missing_and_unknown_arguments_are_usage_errors(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["decide", *arguments])
    assert ended.value.code == Exit.USAGE
    assert "usage: aeros decide" in capsys.readouterr().err


def test_it_is_a_filter_that_answers_each_line_before_the_next_comes() -> None:
    command = [sys.executable, "-m", "aeros", *BENCH, "--skill", "quickly"]
    root = Path(__file__).parents[4]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=root, env=dict(os.environ)
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for _ in range(3):
            process.stdin.write(b"{}\n")
            process.stdin.flush()
            assert json.loads(process.stdout.readline())["verdict"] == "DENY"
        process.stdin.close()
        assert process.stdout.read() == b""
        assert process.wait(30) == Exit.SUCCESS


def test_explanations_are_text_or_json_and_decisions_are_json_or_text(
    fed: Fed, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    good = fed.examples("quickly")[0]
    (found,) = fed.run(good, "--skill", "quickly", "--explain", "--format", "json")
    (plain,) = fed.run(good, "--skill", "quickly")
    assert {name: found[name] for name in plain} == plain
    assert all(found["layers"].values())
    for arguments, expected in (
        (["--explain"], "  proved at installation\n    permission "),
        (["--format", "text"], "ALLOW move(target="),
    ):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(good)))
        assert main([*BENCH, "--skill", "quickly", *arguments]) == Exit.SUCCESS
        assert expected in capsys.readouterr().out


def test_examples_hold_whole_numbers_and_histories(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    data = SITE.parent
    counting = [
        "decide",
        "--site",
        str(data / "counts.yaml"),
        "--ecm",
        str(data / "counting"),
        "--skill",
        "feed",
    ]
    assert main([*counting, "--print-examples"]) == Exit.SUCCESS
    (line,) = capsys.readouterr().out.splitlines()
    assert "count within 60 s (pressed and (not (previously pressed)))" in json.loads(line)["state"]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(line.encode())))
    assert main(counting) == Exit.SUCCESS
    assert json.loads(capsys.readouterr().out)["verdict"] == "ALLOW"


def test_a_module_decides_as_it_is_bound(capsys: pytest.CaptureFixture[str]) -> None:
    module = Path(__file__).parents[2] / "session" / "data" / "hover_high"
    command = ["decide", "--ecm", str(module), "--skill", "rise", "--print-examples"]
    assert main(command) == Exit.REJECTED
    assert "`hover_high` needs `area`" in capsys.readouterr().err
    settings = ["--bind", "hover_high.area=table_area", "--set", "hover_high.pace=60 mm/s"]
    assert main([*command, *settings]) == Exit.SUCCESS
    shown = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    speeds = [one["action"]["parameters"].get("speed", 0) for one in shown]
    assert 0 < max(speeds) <= 0.061
