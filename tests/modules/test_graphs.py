"""Every graph of every shipped module is drawn, also where steps and variables are of another module."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import FOLDERS

SITE = load_site(reference_site_path(), Diagnostics())


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_graph_is_drawn(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert SITE is not None
    found = load_ecm(folder, SITE, Diagnostics())
    assert found is not None
    wanted = [
        ("--task", name, "--kind", kind) for name in found.ecm.tasks for kind in ("rules", "closed-loop")
    ]
    wanted += [("--composition", name, "--kind", "composition") for name in found.ecm.compositions]
    for options in wanted:
        assert main(["graph", str(folder), *options]) == Exit.SUCCESS, options
        assert capsys.readouterr().out.startswith("---\ntitle:")
