"""Migration steps of `ecm.yaml`."""

from __future__ import annotations

from aeros.spec.migrations.yaml_edits import EACH, rename_keys_below, set_value, yaml_step


def _edit_to_2(text: str) -> str:
    names = ("on_failure", "between_tries")
    text = rename_keys_below(text, ["tasks", EACH, "rules", EACH], names, values_but="stop")
    text = rename_keys_below(text, ["compositions", EACH], names, values_but="stop")
    return set_value(text, ["models", EACH, "kind"], "file", of=frozenset({"model", "tool"}))


to_2 = yaml_step("aeros/ecm/2", _edit_to_2)
"""Name what runs between two tries `between_tries`: `on_failure` runs after the last one in version 2.

Models that were of kind `model` or `tool`, and could only be certified, become files, which skills can read.
"""
