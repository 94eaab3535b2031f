"""The reference modules, for tests of instructions; read once for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from aeros.runtime.proving import prove_configuration
from aeros.spec.model.ecm import Ecm
from aeros.spec.text.discovery import reference_site_path

REPOSITORY = Path(__file__).parents[4]
LETTERS = {"make_dumplings": "d", "clean_table": "t", "fetch_object": "f"}


@cache
def reference_modules() -> Mapping[str, Ecm]:
    configuration, _ = prove_configuration([REPOSITORY / "ecms"], reference_site_path(), certified=True)
    return configuration.modules
