"""A condition is data: what decides its trials, all of it, so that equal ones share their trials."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class TrialCondition:
    """What is tried.

    kind: of trial, a key of `kinds.KINDS`.
    plant: `physics` or `symbolic`.
    text: everything else, as canonical JSON.
    """

    kind: str
    plant: str
    canonical_json: str

    @classmethod
    def create(cls, kind: str, plant: str, settings: Mapping[str, Any]) -> TrialCondition:
        """The condition with these settings, JSON values."""
        return cls(kind, plant, json.dumps(settings, sort_keys=True, separators=(",", ":")))

    @property
    def settings(self) -> dict[str, Any]:
        """What it was made of."""
        found: dict[str, Any] = json.loads(self.canonical_json)
        return found

    def digest(self, premises: str) -> str:
        """Names it among all conditions tried on these `premises`, which are named by a digest."""
        told = "\n".join((self.kind, self.plant, self.canonical_json, premises))
        return hashlib.sha256(told.encode()).hexdigest()[:32]
