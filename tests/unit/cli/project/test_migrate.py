from __future__ import annotations

import fcntl
import json
import re
import shutil
from pathlib import Path

import pytest

from aeros.agent.recovery.checkpoint import SCHEMA as CHECKPOINT_VERSION
from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.spec.migrations.migrating import as_imagined_version, with_imagined_version

ROOT = Path(__file__).parents[4]
BASE = ROOT / "docs" / "codes" / "base"
STATE = ROOT / "tests" / "unit" / "spec" / "migrations" / "data" / "state_of_checkpoint_2"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a site and a module `tidy`, whose manifest is of an imagined version 1."""
    with_imagined_version(monkeypatch)
    shutil.copytree(BASE, tmp_path / "base")
    monkeypatch.chdir(tmp_path / "base")
    manifest = tmp_path / "base" / "tidy" / "ecm.yaml"
    manifest.write_bytes(as_imagined_version(manifest.read_text("utf-8")).encode())
    return tmp_path / "base"


@pytest.fixture
def state(tmp_path: Path) -> Path:
    """The state folder that AEROS left at checkpoints of version 2, of an agent that was killed."""
    return Path(shutil.copytree(STATE, tmp_path / "state"))


def test_an_older_manifest_is_refused_until_it_is_migrated(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verify = ["verify", "tidy", "--site", "site.yaml", "--no-lock"]
    assert main(verify) == Exit.REJECTED
    message = capsys.readouterr().out
    assert "error[AE114] format-version: `aeros/ecm/1` is an older format" in message
    assert "help: run `aeros migrate tidy/ecm.yaml`" in message
    assert main(["migrate", "tidy", "site.yaml"]) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "tidy/ecm.yaml: migrated: aeros/ecm/1 -> aeros/ecm/2\n  `time_limit` is `timeout`\n" in message
    assert "1 migrated, 1 current, 0 refused\n" in message
    assert "run `aeros verify` again" in message
    assert (here / "tidy" / "ecm.yaml").read_bytes() == (BASE / "tidy" / "ecm.yaml").read_bytes()
    assert main(verify) == Exit.SUCCESS
    assert main(["migrate", ".", "--check"]) == Exit.SUCCESS


@pytest.mark.parametrize(("option", "code"), [("--check", Exit.REJECTED), ("--diff", Exit.SUCCESS)])
def test_nothing_is_written_where_it_is_not_asked_for(
    here: Path, capsys: pytest.CaptureFixture[str], option: str, code: Exit
) -> None:
    before = (here / "tidy" / "ecm.yaml").read_bytes()
    assert main(["migrate", "tidy", option]) == code
    message = capsys.readouterr().out
    assert "tidy/ecm.yaml: is old: aeros/ecm/1 -> aeros/ecm/2" in message
    assert ("-schema: aeros/ecm/1\n+schema: aeros/ecm/2\n" in message) == (option == "--diff")
    assert "1 to migrate, 0 current, 0 refused" in message
    assert (here / "tidy" / "ecm.yaml").read_bytes() == before


def test_files_of_a_registry_are_not_rewritten(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept = here / "modules" / "digest" / "tidy"
    shutil.copytree(here / "tidy", kept)
    (here / "registry.sqlite3").touch()
    before = (kept / "ecm.yaml").read_bytes()
    assert main(["migrate", "."]) == Exit.REJECTED
    message = capsys.readouterr()
    assert "1 migrated" in message.out
    assert "modules/digest/tidy/ecm.yaml: refused: it is old, and the registry keeps it" in message.err
    assert (kept / "ecm.yaml").read_bytes() == before


def test_mode_links_marks_and_line_ends_stay(here: Path) -> None:
    manifest = here / "tidy" / "ecm.yaml"
    marked = b"\xef\xbb\xbf" + manifest.read_bytes().replace(b"\n", b"\r\n")
    manifest.write_bytes(marked)
    manifest.chmod(0o640)
    link = here / "link.yaml"
    link.symlink_to(manifest)
    assert main(["migrate", str(link)]) == Exit.SUCCESS
    assert link.is_symlink()
    expected = b"\xef\xbb\xbf" + (BASE / "tidy" / "ecm.yaml").read_bytes().replace(b"\n", b"\r\n")
    assert manifest.read_bytes() == expected
    assert manifest.stat().st_mode & 0o777 == 0o640


def test_for_programs_it_says_all_of_it(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "newer.yaml").write_text("schema: aeros/site/9\n")
    assert main(["migrate", ".", "--diff", "--format", "json"]) == Exit.REJECTED
    message = json.loads(capsys.readouterr().out)
    assert (message["schema"], message["written"]) == ("aeros/migration/1", False)
    files = {Path(one["path"]).name: one for one in message["files"]}
    assert files["site.yaml"]["state"] == "current"
    assert files["newer.yaml"]["state"] == "refused"
    assert "`aeros/site/9` was written by a newer AEROS" in files["newer.yaml"]["problem"]
    old = files["ecm.yaml"]
    assert (old["format"], old["from"], old["to"], old["state"]) == ("ecm", 1, 2, "old")
    assert old["changes"] == ["`time_limit` is `timeout`"]
    assert "+schema: aeros/ecm/2\n" in old["diff"]


def test_in_a_folder_what_is_not_of_aeros_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "compose.yaml").write_text("a: &b aeros/x\n")
    (tmp_path / "results.json").write_bytes(b"\xff")
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "ecm.yaml").write_text("schema: aeros/ecm/9\n")
    (tmp_path / "elsewhere.yaml").symlink_to("/dev/null")
    assert main(["migrate", str(tmp_path)]) == Exit.SUCCESS
    assert capsys.readouterr().out == "0 migrated, 0 current, 0 refused\n"


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("compose.yaml", b"a: 1\n", "it is of no format that AEROS migrates"),
        ("notes.txt", b"", "it is of no format that AEROS migrates"),
        ("results.json", b"\xff", "it is not UTF-8 text"),
        ("ecm.yaml", b"schema: aeros/ecm/2\nschema: aeros/ecm/2\n", "AE001: .+ecm.yaml:2:1"),
        ("ecm.yaml", b"id: it\n", "its `schema` is not `aeros/ecm/2`"),
        ("ecm.lock", b'{"schema": "aeros/certificate/0"}', "its `schema` is not `aeros/certificate/1`"),
    ],
)
def test_a_named_file_that_cannot_be_migrated_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: bytes, why: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    assert main(["migrate", str(path)]) == Exit.REJECTED
    message = capsys.readouterr()
    assert message.out == "0 migrated, 0 current, 1 refused\n"
    assert message.err.startswith(f"{path}: refused: ")
    assert re.search(why, message.err)
    assert path.read_bytes() == content


def test_a_state_folder_is_migrated_once(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["migrate", str(state)]) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "2 migrated, 2 current, 0 refused\n" in message
    assert "aeros verify" not in message
    assert main(["migrate", str(state), "--check"]) == Exit.SUCCESS
    kept = json.loads((state / "checkpoint.json").read_text())
    assert kept["schema"] == CHECKPOINT_VERSION


def test_where_an_agent_is_at_work_nothing_is_rewritten(
    state: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (state / "agent.lock").write_text("")
    before = (state / "checkpoint.json").read_bytes()
    with (state / "agent.lock").open("r+") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert main(["migrate", str(state)]) == Exit.REJECTED
    assert "refused: an agent is already running here" in capsys.readouterr().err
    assert (state / "checkpoint.json").read_bytes() == before
    assert main(["migrate", str(state)]) == Exit.SUCCESS
