from __future__ import annotations

import hashlib
import json
from pathlib import Path, PurePath
from typing import Any

import pytest

from aeros.agent.recovery.checkpoint import decode_checkpoint, encode_checkpoint
from aeros.spec.declared.decode import decode
from aeros.spec.declared.ecm import Ecm
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.migrations import formats
from aeros.spec.migrations.checkpoint import _CLASS_NAMES, _FIELD_NAMES, to_3, to_4
from aeros.spec.migrations.format import Format, Kind, UnmigratableError, Version
from aeros.spec.migrations.rewriting import format_of, has_known_name, rewrite
from aeros.spec.migrations.yaml_edits import rename_key
from aeros.spec.text.yaml_reader import read_yaml
from tests.unit.spec.migrations.migrating import OLD_ECM, as_version_0, with_version_0

ROOT = Path(__file__).parents[4]
DATA = Path(__file__).parent / "data" / "state_of_checkpoint_2"
STATE_OF_CHECKPOINT_3 = Path(__file__).parent / "data" / "state_of_checkpoint_3"
MANIFEST = PurePath("tidy/ecm.yaml")


def shipped() -> list[Path]:
    return sorted(ROOT.glob("ecms/*/ecm.yaml"))


@pytest.mark.parametrize("path", shipped(), ids=lambda path: path.parent.name)
def test_a_shipped_manifest_comes_back_byte_for_byte(path: Path) -> None:
    text = path.read_bytes().decode()
    old = as_version_0(text)
    assert old != text
    assert rewrite(path, old, OLD_ECM).text == text
    assert rewrite(path, text, OLD_ECM).text == text


def test_an_older_manifest_is_refused_at_its_schema(monkeypatch: pytest.MonkeyPatch) -> None:
    with_version_0(monkeypatch)
    sink = Diagnostics()
    source = Source("tidy/ecm.yaml", "id: it\nschema: aeros/ecm/0\n")
    node = read_yaml(source, sink)
    assert node is not None
    assert decode(node, Ecm, sink) is None
    (problem,) = sink
    assert problem.code == "AE114"
    assert problem.primary is not None
    assert problem.primary.span.line == 2
    assert problem.help[0] == "run `aeros migrate tidy/ecm.yaml`"


def test_a_checkpoint_of_version_2_gets_the_report_that_it_lacks() -> None:
    path = DATA / "checkpoint.json"
    text = to_3(path.read_text())
    assert json.loads(text)["schema"] == 3
    assert json.loads(json.loads(text)["body"])["ended"] is None
    new = rewrite(path, path.read_text(), formats.CHECKPOINT)
    assert (new.version, len(new.changes)) == (2, 2)
    assert json.loads(json.loads(new.text)["body"])["final_report"] is None
    assert not rewrite(path, new.text, formats.CHECKPOINT).is_changed


@pytest.mark.parametrize("name", ["checkpoint.json", "final.json"])
def test_a_checkpoint_of_version_3_is_read_and_written_by_its_new_names(name: str) -> None:
    path = STATE_OF_CHECKPOINT_3 / name
    new = rewrite(path, path.read_text(), formats.CHECKPOINT)
    assert (new.version, len(new.changes)) == (3, 1)
    content = new.text.encode()
    # A name that is not renamed cannot be decoded, and one that is lost is not encoded again.
    assert encode_checkpoint(decode_checkpoint(content, path)) == content
    assert not rewrite(path, new.text, formats.CHECKPOINT).is_changed


def test_the_checkpoints_of_version_3_hold_every_class_that_has_another_name_now() -> None:
    texts = [(STATE_OF_CHECKPOINT_3 / name).read_text() for name in ("checkpoint.json", "final.json")]
    bodies = [json.loads(text)["body"] for text in texts]
    renamed = (_CLASS_NAMES.keys() | _FIELD_NAMES.keys()) - {"Checkpoint"}
    assert {name for name in renamed if any(f'"class": "{name}"' in body for body in bodies)} == renamed


def test_names_that_a_user_gave_are_not_renamed_in_a_checkpoint() -> None:
    measured = {"class": "Attempt", "fields": {"tuple": ["kept", "reset"]}}
    body = {"world": {"map": measured}, "tried": {"tuple": []}}
    text = json.dumps(body)
    digest = hashlib.sha256(text.encode()).hexdigest()
    new = to_4(json.dumps({"schema": 3, "digest": digest, "body": text}))
    assert json.loads(json.loads(new)["body"]) == {"world": {"map": measured}, "attempts": {"tuple": []}}


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"schema": 1}, "version 1 did not record .+ start it again"),
        ({"schema": 5}, "`5` was written by a newer AEROS"),
        ({"schema": "4"}, "its `schema` is not `4`"),
        ({"digest": "0"}, "its digest does not match"),
        ({"body": 3}, "does not have the layout"),
    ],
)
def test_a_checkpoint_that_cannot_be_rewritten_says_why(change: dict[str, Any], why: str) -> None:
    path = DATA / "checkpoint.json"
    text = json.dumps({**json.loads(path.read_text()), **change})
    with pytest.raises(UnmigratableError, match=why):
        rewrite(path, text, formats.CHECKPOINT)


def test_crashes_of_version_1_are_kept() -> None:
    new = rewrite(PurePath("crashes.json"), '[[1.0, "why"]]', formats.CRASHES)
    assert json.loads(new.text) == {"schema": "aeros/crashes/2", "crashes": [[1.0, "why"]]}
    with pytest.raises(UnmigratableError, match="damaged"):
        rewrite(PurePath("crashes.json"), "{}", formats.CRASHES)


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("any.yaml", "schema: aeros/site/9\n", "site"),
        ("any.yml", '{"schema": "aeros/people/1"}', "people"),
        ("any.yaml", "schema: aeros/unheard-of/1\n", None),
        ("any.yaml", "a: &anchor aeros/ecm\n", None),
        ("ecm.yaml", "id: it\n", "ecm"),
        ("ecm.lock", '{"schema": "aeros/certificate/1"}', "certificate"),
        ("results.json", '{"schema": "aeros/experiments/1"}', "experiments"),
        ("results.json", '{"tests": 3}', None),
        ("results.json", "{", None),
        ("phase.json", '{"phase": "created"}', "phase"),
        ("crashes.json", "[]", "crashes"),
        ("phase.json", "[]", None),
        ("trials.jsonl", '{"condition": "", "seed": 1, "found": {}}\n{"con', "trial"),
        ("other.json", "{}", None),
    ],
)
def test_a_format_is_known_by_name_and_content(name: str, text: str, found: str | None) -> None:
    format_ = format_of(PurePath(name), text)
    assert (None if format_ is None else format_.name) == found
    assert has_known_name(PurePath(name)) == (name != "other.json")


def test_lines_are_as_old_as_the_oldest() -> None:
    step = Version("more", lambda text: text.replace("trial/1", "trial/2"))
    two = Format("trial", "", ("trials.jsonl",), Kind.JSON_LINES, (Version("first"), step))
    text = '{"schema": "aeros/trial/2"}\n{"schema": "aeros/trial/1"}\n'
    new = rewrite(PurePath("trials.jsonl"), text, two)
    assert new.version == 1
    assert new.text == '{"schema": "aeros/trial/2"}\n' * 2
    with pytest.raises(UnmigratableError):
        rewrite(PurePath("trials.jsonl"), text + '{"schema": "aeros/other/1"}\n', two)


def test_a_file_without_its_schema_is_not_migrated() -> None:
    with pytest.raises(UnmigratableError, match="`aeros/ecm/1`"):
        rewrite(MANIFEST, "id: it\n", formats.ECM)


def test_a_step_that_leaves_another_version_is_an_internal_error() -> None:
    forgetful = Format("ecm", "", (), Kind.YAML, (Version("first"), Version("more", lambda text: text)))
    with pytest.raises(InternalError, match="left another version"):
        rewrite(MANIFEST, "schema: aeros/ecm/1\n", forgetful)
    without = Format("ecm", "", (), Kind.YAML, (Version("first"), Version("more")))
    with pytest.raises(InternalError, match="has no step"):
        rewrite(MANIFEST, "schema: aeros/ecm/1\n", without)


def test_two_keys_are_not_made_one() -> None:
    with pytest.raises(UnmigratableError, match="`a` becomes `b`, which line 2 has already"):
        rename_key("a: 1\nb: 2\n", ["a"], "b")


def test_malformed_yaml_is_refused_at_its_place() -> None:
    with pytest.raises(UserError, match="AE009"):
        rename_key('a: "', ["a"], "b")
