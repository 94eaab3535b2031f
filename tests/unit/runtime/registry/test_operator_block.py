"""Blocks by module, version, digest, skill and action kind."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.registry.operator_block import (
    UNKNOWN_DIGEST,
    ModuleIdentity,
    OperatorBlock,
    parse_digest,
    parse_versions,
)
from aeros.spec.model.policy import OperatorOverride

TIDY = ModuleIdentity("1.1.0", "a" * 64, frozenset({"gpu"}))
CHANNELS = {"move": frozenset({"field_bus"}), "ask": frozenset({"internet"}), "grip": frozenset[str]()}


def block(**parts: Any) -> OperatorBlock:
    empty = dict.fromkeys(("module", "skill", "action", "version", "digest"))
    return OperatorBlock("one", "why", **{**empty, **parts})


@pytest.mark.parametrize(
    ("parts", "matches"),
    [
        ({}, True),
        ({"module": "tidy"}, True),
        ({"module": "other"}, False),
        ({"module": "tidy", "skill": "wipe"}, True),
        ({"module": "tidy", "skill": "rest"}, False),
        ({"action": "move"}, True),
        ({"action": "grip"}, False),
        ({"module": "tidy", "version": "==1.1.0"}, True),
        ({"module": "tidy", "version": "==1.1"}, True),
        ({"module": "tidy", "version": "<1.1"}, False),
        ({"module": "tidy", "version": ">=1.0,<1.2"}, True),
        ({"module": "tidy", "version": "<2", "skill": "rest"}, False),
        ({"digest": "a" * 64}, True),
        ({"digest": "b" * 64}, False),
        ({"digest": "a" * 64, "module": "other"}, False),
        ({"module": "tidy", "version": "nonsense"}, True),
        ({"channel": "field_bus"}, True),
        ({"channel": "field_bus", "action": "move"}, True),
        ({"channel": "field_bus", "action": "ask"}, False),
        ({"channel": "internet"}, False),
        ({"device": "gpu"}, True),
        ({"device": "gpu", "skill": "rest"}, False),
        ({"device": "camera_chip"}, False),
        ({"device": "gpu", "channel": "internet"}, False),
    ],
)
def test_every_part_that_is_given_must_match(parts: dict[str, str], matches: bool) -> None:
    made = block(**parts)
    assert made.matches("tidy", TIDY, "wipe", "move", CHANNELS["move"]) is matches
    overrides = made.overrides({"tidy": TIDY}, CHANNELS)
    assert any(one.matches("tidy", "wipe", "move") for one in overrides) is matches


def test_pre_releases_and_unknown_digests_are_blocked_as_well() -> None:
    assert block(module="tidy", version=">=1").applies_to("tidy", ModuleIdentity("2.0.0a1", "a"))
    assert block(digest="b" * 64).applies_to("tidy", ModuleIdentity("1.0", UNKNOWN_DIGEST))


def test_a_module_whose_devices_are_unknown_is_blocked_with_every_device() -> None:
    unknown = ModuleIdentity("1.0", "a" * 64)
    assert block(device="gpu").applies_to("tidy", unknown)
    assert not block(device="gpu").applies_to("tidy", unknown._replace(devices=frozenset()))


def test_a_block_of_a_channel_names_the_actions_behind_it() -> None:
    two = {**CHANNELS, "send": frozenset({"internet"})}
    found = block(channel="internet", module="tidy").overrides({"tidy": TIDY}, two)
    assert [(one.module, one.action) for one in found] == [("tidy", "ask"), ("tidy", "send")]


def test_a_block_of_a_version_names_the_loaded_modules_that_have_it() -> None:
    others = {"tidy": TIDY, "grip": ModuleIdentity("1.1.0", "b" * 64)}
    assert block(digest="b" * 64, action="move").overrides(others, CHANNELS) == (
        OperatorOverride("one", "why", "grip", None, "move"),
    )
    assert block(module="gone", version="<2").overrides(others, CHANNELS) == ()
    gone = block(module="gone").overrides(others, CHANNELS)
    assert gone == (OperatorOverride("one", "why", "gone", None, None),)


def test_the_scope_names_every_part() -> None:
    assert block(channel="internet", device="gpu").scope == "channel internet, device gpu"
    made = block(module="tidy", version="<2", digest="a" * 64, skill="wipe", action="move")
    assert made.scope == f"module tidy, version <2, digest sha256:{'a' * 64}, skill wipe, action move"


@pytest.mark.parametrize(
    ("text", "specifier"), [("1.0.0", "==1.0.0"), ("<1.2", "<1.2"), (">=1.0,<1.2", "<1.2,>=1.0")]
)
def test_a_version_is_one_or_a_range(text: str, specifier: str) -> None:
    assert parse_versions(text) == specifier


@pytest.mark.parametrize("text", ["", "new", "<", "1.0 to 2.0"])
def test_text_that_is_no_version_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"as in <1\.2"):
        parse_versions(text)


def test_a_digest_is_read_as_it_is_printed() -> None:
    for text in ("A" * 64, f"sha256:{'a' * 64}"):
        assert parse_digest(text) == "a" * 64
    for text in ("", "a" * 63, "g" * 64, f"sha1:{'a' * 64}"):
        with pytest.raises(ValueError, match="64 hexadecimal digits"):
            parse_digest(text)
