"""Conditions of trials as data: all that decides the trials, so that equal conditions share them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class TrialCondition:
    """Condition of trials.

    Attributes:
        kind: kind of trial, a key of `trial_kinds.KINDS`.
        plant: `physics` or `symbolic`.
        canonical_json: the settings, which are everything else, as canonical JSON.
    """

    kind: str
    plant: str
    canonical_json: str

    @classmethod
    def create(cls, kind: str, plant: str, settings: Mapping[str, Any]) -> TrialCondition:
        """Create a condition.

        Args:
            kind: kind of trial, a key of `trial_kinds.KINDS`.
            plant: `physics` or `symbolic`.
            settings: everything else that decides the trials, JSON values by name.

        Returns:
            The condition.
        """
        return cls(kind, plant, json.dumps(settings, sort_keys=True, separators=(",", ":")))

    @property
    def settings(self) -> dict[str, Any]:
        """The settings, parsed from JSON; a new dictionary at each call."""
        settings: dict[str, Any] = json.loads(self.canonical_json)
        return settings

    def digest(self, premises: str) -> str:
        """Name the condition among all that are tried on the same premises.

        Args:
            premises: digest of what the trials stand on.

        Returns:
            32 hexadecimal digits of a SHA-256.
        """
        text = "\n".join((self.kind, self.plant, self.canonical_json, premises))
        return hashlib.sha256(text.encode()).hexdigest()[:32]
