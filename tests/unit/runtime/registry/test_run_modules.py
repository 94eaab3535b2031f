"""Modules of a run: when the operator withdraws them, and which policy and blocks are in force."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import ModuleIdentity, OperatorBlock
from aeros.runtime.registry.run_modules import (
    LoadedModules,
    blocks_in_force,
    policy_in_force,
    withdrawal_reason,
)
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot

MINE = ModuleIdentity("1.0.0", "a" * 64)
KINDS = {"ask": SimpleNamespace(channels=frozenset({"internet"}))}
INACTIVE, OTHER = "`tidy` is no longer active", "`tidy` now has another version"


def _snapshot(state: ModuleState | None, digest: str = "a", **parts: Any) -> RegistrySnapshot:
    modules = {} if state is None else {"tidy": InstalledModule("tidy", "1.0.0", digest * 64, state)}
    return RegistrySnapshot(3, "policies/now.yaml", modules, **parts)


@pytest.mark.parametrize(
    ("now", "of_registry", "of_folder"),
    [
        (_snapshot(None), INACTIVE, None),
        (_snapshot(ModuleState.INSTALLED), INACTIVE, None),
        (_snapshot(ModuleState.CONFIGURED, "b"), INACTIVE, None),
        (_snapshot(ModuleState.CONFIGURED, withdrawn=frozenset({"tidy"})), INACTIVE, INACTIVE),
        (_snapshot(None, withdrawn=frozenset({"tidy"})), INACTIVE, INACTIVE),
        (_snapshot(None, withdrawn=frozenset({"other"})), INACTIVE, None),
        (_snapshot(ModuleState.ACTIVE), None, None),
        (_snapshot(ModuleState.ACTIVE, "b"), OTHER, OTHER),
    ],
)
def test_a_module_is_withdrawn_by_the_registry(
    now: RegistrySnapshot, of_registry: str | None, of_folder: str | None
) -> None:
    assert withdrawal_reason(now, "tidy", MINE, is_installed=True) == of_registry
    assert withdrawal_reason(now, "tidy", MINE, is_installed=False) == of_folder


def test_the_policy_of_a_run_holds_until_the_operator_sets_one() -> None:
    assert policy_in_force(_snapshot(None), "policies/mine.yaml") == "policies/mine.yaml"
    assert policy_in_force(_snapshot(None, is_policy_set=True), "policies/mine.yaml") == "policies/now.yaml"


def test_an_action_goes_on_until_it_is_revoked() -> None:
    loaded = LoadedModules(
        RegistrySnapshot(),
        "policies/mine.yaml",
        {"tidy": MINE},
        *cast(tuple[Any, Any], (SimpleNamespace(site=SimpleNamespace(kinds=KINDS)), None)),
        {},
        is_installed=False,
    )
    block = OperatorBlock("one", "worn", "tidy", None, "grip", "<2")
    offline = OperatorBlock("one", "no line", None, None, None, channel="internet")
    for now, kind, reason in (
        (_snapshot(None), "grip", None),
        (_snapshot(None, withdrawn=frozenset({"tidy"})), "grip", INACTIVE),
        (_snapshot(None, is_policy_set=True), "grip", "another policy is in force"),
        (_snapshot(None, blocks={"one": block}), "grip", "the operator blocks it: worn"),
        (_snapshot(None, blocks={"one": block}), "move", None),
        (_snapshot(None, blocks={"one": offline}), "move", None),
        (_snapshot(None, blocks={"one": offline}), "ask", "the operator blocks it: no line"),
    ):
        assert loaded.revocation_reason(now, "tidy", "wipe", kind) == reason
    assert loaded.revocation_reason(_snapshot(None), "gone", "x", "move") == "`gone` is no longer active"


def test_blocks_become_overrides_in_the_order_of_their_ids() -> None:
    blocks = {name: OperatorBlock(name, "why", "tidy", None, None, "<2") for name in ("a", "b")}
    now = _snapshot(None, blocks=blocks)
    assert [one.id for one in blocks_in_force(now, {"tidy": MINE}, {})] == ["a", "b"]
    assert blocks_in_force(now, {"tidy": ModuleIdentity("2.0", "a" * 64)}, {}) == ()
