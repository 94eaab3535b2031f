"""A step for tests: an imagined version 0 of manifests, in which `timeout` of a skill was `time_limit`."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Version
from aeros.spec.migrations.yaml_edits import EACH, rename_key, set_value, yaml_step

STEP = yaml_step("aeros/ecm/1", lambda text: rename_key(text, ["skills", EACH, "time_limit"], "timeout"))
OLD_ECM = replace(
    formats.ECM, first=0, versions=(Version("imagined"), Version("`time_limit` is `timeout`", STEP))
)


def with_version_0(patch: pytest.MonkeyPatch) -> None:
    """Let manifests have the version 0."""
    others = [one for one in formats.FORMATS if one is not formats.ECM]
    patch.setattr(formats, "FORMATS", (OLD_ECM, *others))


def as_version_0(text: str) -> str:
    """A manifest as it would have been."""
    return set_value(rename_key(text, ["skills", EACH, "timeout"], "time_limit"), ["schema"], "aeros/ecm/0")
