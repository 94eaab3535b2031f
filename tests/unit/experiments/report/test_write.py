"""Files of a report, and one page over several."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="needs `pip install '.[experiments]'`")
pytest.importorskip("markdown_it", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.catalogue import catalogue
from aeros.experiments.report.figures import ReportFigure
from aeros.experiments.report.write import FIGURES, RESULTS, index_page, is_stale, write_report
from aeros.experiments.trial_kinds import condition_digest
from tests.unit.experiments.report.made_up import experiment, results, row, share

ROW = row("4/a", {"success": share(60.0, 65.0)}, labels=["é"])


@pytest.fixture(autouse=True)
def _figures_that_cost_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ReportFigure, "svg", property(lambda figure: f"<svg>{figure.name}</svg>"))


def made(number: int, plant: str = "symbolic", **more: Any) -> dict[str, Any]:
    return results(experiment(ROW, number=number, **more), plant=plant)


def test_data_pages_and_figures_are_written(tmp_path: Path) -> None:
    given = made(4, figure="intervals")
    write_report(given, tmp_path)
    files = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert files == ["figures/experiment-4.svg", "report.html", "report.md", "results.json"]
    text = (tmp_path / RESULTS).read_text(encoding="utf-8")
    assert json.loads(text) == given
    assert text.endswith("\n")
    assert '"é"' in text
    assert (tmp_path / FIGURES / "experiment-4.svg").read_text() == "<svg>experiment-4</svg>"
    assert "![made up](figures/experiment-4.svg)" in (tmp_path / "report.md").read_text(encoding="utf-8")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<title>AEROS experiments</title>" in page
    assert "<svg>experiment-4</svg>" in page


def test_a_report_is_written_over_one_that_is_there(tmp_path: Path) -> None:
    write_report(made(4, figure="intervals"), tmp_path)
    write_report(made(5), tmp_path)
    assert "Experiment 5" in (tmp_path / "report.md").read_text(encoding="utf-8")


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        write_report(made(4), tmp_path / "none")


def test_the_page_over_several_has_the_lowest_first_and_of_these_physics(tmp_path: Path) -> None:
    folders = []
    for name, number, plant in (("b", 4, "symbolic"), ("c", 11, "symbolic"), ("a", 4, "physics")):
        folder = tmp_path / "results" / name
        folder.mkdir(parents=True)
        write_report(made(number, plant, figure="intervals"), folder)
        folders.append(folder)
    page = index_page(folders, "")
    assert page.startswith("# Results\n\nEach question has one table")
    rows = re.findall(
        r"^\| \[(.+?)\]\((.+?)\) \| 100 \| .+ \| \*\*stale\*\* \| \[results\]\((.+?)\) \|$",
        page,
        re.MULTILINE,
    )
    assert rows == [
        (
            f"Experiment {number} on the {plant} plant",
            f"results/{name}/report.md",
            f"results/{name}/results.json",
        )
        for number, plant, name in ((4, "physics", "a"), (4, "symbolic", "b"), (11, "symbolic", "c"))
    ]
    for folder in folders:
        given = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
        (folder / RESULTS).write_text(json.dumps(given | {"sources": "now"}), encoding="utf-8")
    assert index_page(folders, "now").count("| of this code |") == 3


def test_of_a_report_the_lowest_experiment_counts(tmp_path: Path) -> None:
    several = results(experiment(ROW, number=9), experiment(ROW, number=2), experiment(ROW, number=3))
    for name, given in (("x", made(5)), ("y", several)):
        (tmp_path / name).mkdir()
        write_report(given, tmp_path / name)
    page = index_page([tmp_path / "x", tmp_path / "y"], "")
    lines = [line for line in page.splitlines() if line.startswith("| [")]
    assert lines[0].startswith("| [Experiments 2 to 3, 9 on the symbolic plant](")
    assert lines[1].startswith("| [Experiment 5")


def test_results_of_another_condition_or_kind_of_trial_are_stale() -> None:
    now = next(row for row in catalogue("symbolic")[4].rows if row.id == "4/flat/clean_table")
    given = results(experiment({**ROW, "id": now.id}), premises="p", sources="now")
    (one,) = given["experiments"][0]["rows"]
    assert is_stale(given, "now")  # the digest is of other settings, or of another `trials/task.py`
    one["digest"] = condition_digest(now.condition, "p")
    assert not is_stale(given, "now")
    assert is_stale(given, "later")
