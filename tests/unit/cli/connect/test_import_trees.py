"""`aeros import bt` as people run it: what it prints, writes and refuses."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

TREE = """\
<root BTCPP_format="4">
  <BehaviorTree ID="Tidy">
    <Fallback>
      <Condition ID="TableTidy"/>
      <Action ID="Sweep"/>
    </Fallback>
  </BehaviorTree>
</root>
"""
MODULE = Path(__file__).parents[3] / "corpus" / "accepted" / "alternatives_and_tries"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    path = tmp_path / "tidy.xml"
    path.write_text(TREE)
    return path


def test_a_composition_is_printed_and_every_node_is_reported(
    tree: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["import", "bt", str(tree)]) == Exit.SUCCESS
    shown = capsys.readouterr()
    assert shown.out == (
        'compositions:\n  tidy:\n    description: "the behaviour tree Tidy"\n    do:\n      any:\n'
        "        - {check: table_tidy}\n        - {skill: sweep, on_failure: stop}\n"
    )
    assert f"{tree}:3: Fallback imported as any" in shown.err
    assert "Tidy: 3 of 3 nodes imported" in shown.err


def test_a_refused_node_is_reported_and_nothing_is_written(
    tree: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "module"
    shutil.copytree(MODULE, module)
    tree.write_text(TREE.replace("Fallback>", "ReactiveFallback>").replace("Condition ID", "Action ID"))
    assert main(["import", "bt", str(tree), "--into", str(module)]) == Exit.REJECTED
    shown = capsys.readouterr()
    assert shown.out == ""
    assert f"{tree}:3: ReactiveFallback refused: " in shown.err
    assert (module / "ecm.yaml").read_bytes() == (MODULE / "ecm.yaml").read_bytes()
    assert main(["import", "bt", str(tree), "--format", "json"]) == Exit.REJECTED
    report = json.loads(capsys.readouterr().out)
    assert (report["imported"], report["do"], report["nodes"][0]["line"]) == (False, None, 3)


def test_it_is_added_to_a_module(tree: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = tmp_path / "module"
    shutil.copytree(MODULE, module)
    command = ["import", "bt", str(tree), "--into", str(module), "--condition", "TableTidy=table_tidy"]
    assert main([*command, "--action", "Sweep=scrub"]) == Exit.SUCCESS
    assert "  tidy:\n" in (module / "ecm.yaml").read_text()
    assert main(command) == Exit.REJECTED
    assert "it has a composition `tidy`; choose another name by --name" in capsys.readouterr().err
    before = tree.read_bytes()
    for other in (tree, tmp_path):
        with pytest.raises(SystemExit, match=str(Exit.USAGE.value)):
            main(["import", "bt", str(tree), "--into", str(other)])
        assert "is neither a module's folder nor its `ecm.yaml`" in capsys.readouterr().err
    assert tree.read_bytes() == before
    manifest = module / "ecm.yaml"
    manifest.write_text("id: [m\n")
    assert main([*command, "--name", "other"]) == Exit.REJECTED
    assert "cannot be read as a manifest" in capsys.readouterr().err
    assert manifest.read_text() == "id: [m\n"


@pytest.mark.parametrize(
    ("given", "exit_", "message"),
    [
        (["--tree", "Tiddy"], Exit.USAGE, "no tree `Tiddy` is in these files; did you mean `Tidy`?"),
        (["--tree", "Other"], Exit.USAGE, "no tree `Other` is in these files"),
        (["--action", "Sweeep=a"], Exit.USAGE, "no leaf `Sweeep` is in these files; did you mean `Sweep`?"),
        (["--condition", "Xyzzy=a"], Exit.USAGE, "`--condition Xyzzy=…`: no leaf `Xyzzy` is in these files"),
        (["--condition", "Sweep=a", "--action", "Sweep=b"], Exit.USAGE, "`Sweep` is bound both by --action"),
        (["--action", "Sweep"], Exit.USAGE, "`--action Sweep` is not of the form ID=VALUE"),
    ],
)
def test_a_request_that_means_nothing_is_refused(
    tree: Path, given: list[str], exit_: Exit, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["import", "bt", str(tree), *given]) == exit_
    assert message in capsys.readouterr().err


def test_files_without_a_tree_are_refused(tree: Path, capsys: pytest.CaptureFixture[str]) -> None:
    second = TREE[TREE.index("  <") :].replace('"Tidy"', '"Again"')
    for text, message in (
        ("<root/>", "no <BehaviorTree> is in these files"),
        ("<root>", f"{tree}:1: is not well-formed XML"),
        (TREE.replace("</root>", second), "choose by --tree among `Again`, `Tidy`"),
    ):
        tree.write_text(text)
        assert main(["import", "bt", str(tree)]) in (Exit.USAGE, Exit.REJECTED)
        assert message in capsys.readouterr().err


def test_faults_of_a_file_have_their_place_in_the_report_too(
    tree: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tree.write_text(TREE.replace("Fallback>", "Fallback>&gone;"))
    assert main(["import", "bt", str(tree), "--format", "json"]) == Exit.REJECTED
    (node,) = json.loads(capsys.readouterr().out)["nodes"]
    assert (node["file"], node["line"]) == (str(tree), 3)
    tree.write_text(TREE.replace('"4"', '"4" main_tree_to_execute="Tidi"'))
    assert main(["import", "bt", str(tree)]) == Exit.USAGE
    shown = capsys.readouterr().err
    assert f"{tree}:1: no tree `Tidi` is in these files; did you mean `Tidy`?" in shown
