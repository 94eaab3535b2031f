"""A step for tests: an imagined version 1 of manifests, in which `timeout` of a skill was `time_limit`."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Version
from aeros.spec.migrations.yaml_edits import EACH, rename_key, set_value, yaml_step

STEP = yaml_step("aeros/ecm/2", lambda text: rename_key(text, ["skills", EACH, "time_limit"], "timeout"))
OLD_ECM = replace(formats.ECM, versions=(Version("imagined"), Version("`time_limit` is `timeout`", STEP)))


def with_imagined_version(patch: pytest.MonkeyPatch) -> None:
    """Let manifests have the imagined version 1."""
    others = [one for one in formats.FORMATS if one is not formats.ECM]
    patch.setattr(formats, "FORMATS", (OLD_ECM, *others))


def as_imagined_version(text: str) -> str:
    """A manifest as it would have been."""
    return set_value(rename_key(text, ["skills", EACH, "timeout"], "time_limit"), ["schema"], "aeros/ecm/1")
