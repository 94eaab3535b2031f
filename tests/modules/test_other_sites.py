"""The shipped modules are proved as bound at sites that the reference site's author has not written."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.modules.other_sites import BOUND, bindings, site_with_other_names, slower_site
from tests.repo.tree import ROOT

FOLDERS = [
    str(path.parent) for folder in ("ecms", "learned") for path in sorted((ROOT / folder).glob("*/ecm.yaml"))
]
TABLE = [str(ROOT / name) for name in ("ecms/clean_table", "ecms/inspect_table", "ecms/serve_table")]


def verified(*arguments: str) -> int:
    return main(["verify", "--no-lock", *arguments])


def test_every_shipped_module_is_tried() -> None:
    assert BOUND.keys() == {Path(folder).name for folder in FOLDERS}


@pytest.mark.parametrize("plant_words", [False, True])
def test_every_module_is_proved_at_a_site_with_other_names(plant_words: bool, tmp_path: Path) -> None:
    site = site_with_other_names(tmp_path, plant_words=plant_words)
    assert verified(*FOLDERS, "--site", str(site), *bindings()) == Exit.SUCCESS


@pytest.mark.parametrize(
    ("module", "need"), [(module, need) for module, all_ in BOUND.items() for need in all_]
)
def test_only_the_listed_needs_have_to_be_bound(
    module: str, need: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = site_with_other_names(tmp_path)
    folder = next(one for one in FOLDERS if Path(one).name == module)
    given = [one for one in bindings(module) if one != "--bind" and not one.startswith(f"{module}.{need}=")]
    words = [word for one in given for word in ("--bind", one)]
    assert verified(folder, "--site", str(site), *words) == Exit.REJECTED
    assert f"`{module}` needs `{need}`" in capsys.readouterr().out


def test_a_module_is_proved_for_a_slower_arm_if_it_is_configured_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = slower_site(tmp_path)
    learned = str(ROOT / "learned" / "hold_sponge")
    assert verified(*TABLE, learned, "--site", str(site)) == Exit.SUCCESS
    text = site.read_text()
    assert "330 mm/s" in text
    site.write_text(text.replace("330 mm/s", "360 mm/s"))
    assert verified(*TABLE, "--site", str(site)) == Exit.REJECTED
    assert "cell-speed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("module", "missing"),
    [
        ("make_dumplings", "`press_area`, a volume that offers `press_area`, and this site has none"),
        ("fetch_object", "`hand`, a camera that offers `hand_view`, and this site has none"),
    ],
)
def test_a_module_says_what_a_site_lacks(
    module: str, missing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = slower_site(tmp_path)
    assert verified(str(ROOT / "ecms" / module), "--site", str(site)) == Exit.REJECTED
    assert f"`{module}` needs {missing}" in capsys.readouterr().out
