"""The shipped modules reach their goals in truth at two sites beside the reference site."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.modules.other_sites import bindings, site_with_other_names, slower_site
from tests.repo.tree import ROOT

pytestmark = pytest.mark.physics


@pytest.mark.parametrize(
    ("modules", "instruction", "make_site"),
    [
        pytest.param(("ecms/clean_table",), "clean the table", slower_site, marks=pytest.mark.deep),
        pytest.param(
            ("ecms/make_dumplings",), "make dumplings", site_with_other_names, marks=pytest.mark.deep
        ),
        pytest.param(
            ("ecms/fetch_object",), "fetch the object", site_with_other_names, marks=pytest.mark.deep
        ),
        (("learned/hold_sponge",), "hold the sponge", site_with_other_names),
        pytest.param(
            ("ecms/clean_table", "ecms/inspect_table", "ecms/serve_table"),
            "get the table ready for guests",
            slower_site,
            marks=pytest.mark.deep,
        ),
        pytest.param(("ecms/clean_table",), "clean the table", site_with_other_names, marks=pytest.mark.deep),
    ],
)
def test_the_goal_is_reached(
    modules: tuple[str, ...],
    instruction: str,
    make_site: Callable[[Path], Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for module in modules:
        shutil.copytree(ROOT / module, tmp_path / "modules" / Path(module).name)
    names = [Path(module).name for module in modules]
    bound = [] if make_site is slower_site else bindings(*names)
    around = ["--site", str(make_site(tmp_path)), *bound]
    assert main(["verify", str(tmp_path / "modules"), *around]) == Exit.SUCCESS
    out = ["--out", str(tmp_path / "out"), "--state", str(tmp_path / "robot"), "--no-film"]
    ran = ["run", instruction, "--ecms", str(tmp_path / "modules"), "--seed", "100"]
    assert main([*ran, *around, *out]) == Exit.SUCCESS
    printed = capsys.readouterr().out
    assert "true in the simulator" in printed
