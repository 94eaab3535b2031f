"""The object on docs/how-to/add-an-object.md is understood, stands in its scene and is refereed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.scenes.load import load_scene
from tests.repo.tree import ROOT

PAGE = (ROOT / "docs" / "how-to" / "add-an-object.md").read_text(encoding="utf-8")
SAYS = "bring me the bottle"
VALUES = ("anywhere", "middle", "left", "right")


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """The page's overlay and scene."""
    texts = re.findall(r"^```yaml\n(# (\S+):.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert [name for _, name in texts] == ["cell.yaml", "room.yaml"]
    for text, name in texts:
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / "cell.yaml", tmp_path / "room.yaml"


def test_the_referee_knows_the_new_object_for_each_place(files: tuple[Path, Path]) -> None:
    scene = load_scene(str(files[1]), [ROOT / "ecms" / "fetch_object"])
    assert scene.robot is not None
    names = {f"fetch_object.object_delivered(object = green_bottle, to = {to})" for to in VALUES}
    assert names <= scene.truth.keys()


@pytest.mark.physics
@pytest.mark.deep
def test_it_is_delivered_in_the_scene_of_all_tasks(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (lines,) = re.findall(r"^```text\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    text = files[1].read_text(encoding="utf-8")
    old = ("include: [{scene: fetch}]", "    from: stand", "  object: {red_can: can,")
    include, robot, place, values = lines.splitlines()
    for one, new in zip(old, (f"{include}\n{robot}", place, values.split(" blue_block")[0]), strict=True):
        assert text.count(one) == 1
        text = text.replace(one, new)
    files[1].write_text(text, encoding="utf-8")
    where = ["--out", str(tmp_path / "out"), "--state", str(tmp_path / "state"), "--no-film"]
    assert main(["run", SAYS, "--site", str(files[0]), "--scene", str(files[1]), *where]) == Exit.SUCCESS
    assert "believed true, true in the simulator" in capsys.readouterr().out


def test_an_instruction_that_names_it_is_understood(
    files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tasks", SAYS, "--site", str(files[0])]) == Exit.SUCCESS
    assert capsys.readouterr().out.strip() in PAGE
    assert main(["tasks", SAYS]) != Exit.SUCCESS


@pytest.mark.physics
@pytest.mark.deep
def test_it_is_delivered_in_truth(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site, scene = map(str, files)
    where = ["--out", str(tmp_path / "out"), "--state", str(tmp_path / "state"), "--no-film"]
    assert main(["run", SAYS, "--site", site, "--scene", scene, "--seed", "6", *where]) == Exit.SUCCESS
    assert "believed true, true in the simulator" in capsys.readouterr().out
