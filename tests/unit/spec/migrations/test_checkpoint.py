"""Checkpoints of older versions are rewritten or refused, and never half."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, Final

import pytest

from aeros.agent.recovery.checkpoint import decode_checkpoint, encode_checkpoint
from aeros.spec.migrations import formats
from aeros.spec.migrations.checkpoint import (
    _CLASS_NAMES,
    _FIELD_NAMES,
    to_2,
    to_3,
    to_4,
    to_5,
    to_6,
    to_7,
    to_8,
    to_9,
)
from aeros.spec.migrations.format import UnmigratableError
from aeros.spec.migrations.rewriting import rewrite

DATA = Path(__file__).parent / "data" / "state_of_checkpoint_2"
STATE_OF_CHECKPOINT_3 = Path(__file__).parent / "data" / "state_of_checkpoint_3"


def test_a_checkpoint_of_version_2_gets_the_report_that_it_lacks() -> None:
    path = DATA / "checkpoint.json"
    text = to_3(path.read_text())
    assert json.loads(text)["schema"] == 3
    assert json.loads(json.loads(text)["body"])["ended"] is None
    new = rewrite(path, path.read_text(), formats.CHECKPOINT)
    assert (new.version, len(new.changes)) == (2, 7)
    assert json.loads(json.loads(new.text)["body"])["final_report"] is None
    assert not rewrite(path, new.text, formats.CHECKPOINT).is_changed


_NEWER: Final = {"is_stop", "is_exhausted", "part_starts"}
"""Fields that have a default, so that a checkpoint without them is read as it is."""


def _body(content: bytes) -> Any:
    return json.loads(json.loads(content)["body"])


def _without_newer(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_newer(one) for key, one in value.items() if key not in _NEWER}
    return [_without_newer(one) for one in value] if isinstance(value, list) else value


@pytest.mark.parametrize("name", ["checkpoint.json", "final.json"])
def test_a_checkpoint_of_version_3_is_read_and_written_by_its_new_names(name: str) -> None:
    path = STATE_OF_CHECKPOINT_3 / name
    new = rewrite(path, path.read_text(), formats.CHECKPOINT)
    assert (new.version, len(new.changes)) == (3, 6)
    content = new.text.encode()
    # A name that is not renamed cannot be decoded, and one that is lost is not encoded again.
    again = encode_checkpoint(decode_checkpoint(content, path))
    assert _without_newer(_body(again)) == _body(content)
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
        ({"schema": 10}, "`10` was written by a newer AEROS"),
        ({"schema": "5"}, "its `schema` is not `9`"),
        ({"digest": "0"}, "its digest does not match"),
        ({"body": 3}, "does not have the layout"),
    ],
)
def test_a_checkpoint_that_cannot_be_rewritten_says_why(change: dict[str, Any], why: str) -> None:
    path = DATA / "checkpoint.json"
    text = json.dumps({**json.loads(path.read_text()), **change})
    with pytest.raises(UnmigratableError, match=why):
        rewrite(path, text, formats.CHECKPOINT)


def wrapped(body: Any, schema: int = 3, digest: str | None = None) -> str:
    text = body if isinstance(body, str) else json.dumps(body)
    digest = hashlib.sha256(text.encode()).hexdigest() if digest is None else digest
    return json.dumps({"schema": schema, "digest": digest, "body": text})


def unwrapped(text: str) -> Any:
    envelope = json.loads(text)
    assert envelope["digest"] == hashlib.sha256(envelope["body"].encode()).hexdigest()
    return json.loads(envelope["body"])


def test_a_checkpoint_of_version_1_is_never_rewritten() -> None:
    with pytest.raises(UnmigratableError, match="without `--resume`"):
        to_2(wrapped({}))


def test_the_new_version_and_digest_are_written() -> None:
    text = to_3(wrapped({"b": 1, "a": None}, 2))
    assert json.loads(text)["schema"] == 3
    assert json.loads(to_4(text))["schema"] == 4
    assert unwrapped(to_5(to_4(text))) == {
        "a": None,
        "b": 1,
        "final_report": None,
        "errand": 0,
        "earlier_reports": {"tuple": []},
    }
    assert unwrapped(text) == {"a": None, "b": 1, "ended": None}
    assert json.loads(text)["body"] == '{"a": null, "b": 1, "ended": null}'


def test_classes_and_their_fields_are_renamed_wherever_they_are() -> None:
    since = {
        "class": "Since",
        "fields": {"kept": {"class": "Table", "fields": {"name": "kept"}}, "within": 2},
    }
    body = {"head": {"class": "Head", "fields": {"head": 1}}, "waited": [{"deep": since}], "other": 1}
    new = {"class": "Since", "fields": {"sustained": {"class": "ConstantTable", "fields": {"name": "kept"}}}}
    new["fields"]["window_s"] = 2  # type: ignore[index]
    assert unwrapped(to_4(wrapped(body))) == {
        "audit_head": {"class": "LogHead", "fields": {"head": 1}},
        "waited_s": [{"deep": new}],
        "other": 1,
    }


def test_a_skill_that_ran_between_two_tries_still_does() -> None:
    def step(skill: str, **more: Any) -> dict[str, Any]:
        plain = {"module": "m", "skill": skill, "inputs": {"map": {}}}
        return {"class": "PlanStep", "fields": plain | more}

    kept = {"map": {"class": "PlanStep", "fields": step("x", on_failure="y", handler=None)["fields"]}}
    parts = [
        step("wrap", on_failure="recover", handler=None),
        step("dough", on_failure=None, handler=step("align", on_failure=None, handler=None)),
    ]
    new = unwrapped(to_6(wrapped({"plan": {"tuple": parts}, "world": kept}, 5)))
    none = {"between_tries": None, "on_failure": None, "needs_recovery": False}
    assert new["plan"]["tuple"] == [
        step("wrap", **none | {"between_tries": step("recover")}),
        step("dough", **none | {"between_tries": step("align", **none), "needs_recovery": True}),
    ]
    assert new["world"] == kept


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"body": "{}"}', wrapped("not json"), wrapped("[1]"), wrapped({}, digest="0"), "[" * 9],
)
def test_a_damaged_checkpoint_is_refused_by_every_step(text: str) -> None:
    for step in (to_3, to_4, to_5, to_6, to_7, to_8):
        with pytest.raises(UnmigratableError, match="it is damaged"):
            step(text)


def test_no_report_of_version_8_is_skipped() -> None:
    report = {"class": "RunReport", "fields": {"reached": True}}
    body = {"final_report": None, "earlier_reports": {"tuple": [report]}}
    new = unwrapped(to_9(wrapped(body, 8)))
    fields = {"reached": True, "skipped": False}
    assert new == {"final_report": None, "earlier_reports": {"tuple": [{**report, "fields": fields}]}}


def test_a_number_that_is_none_is_refused() -> None:
    with pytest.raises(UnmigratableError, match="it is damaged"):
        to_4(wrapped('{"waited": NaN}'))
