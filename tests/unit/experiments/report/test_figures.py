"""Figures of experiments: which there are, and what is drawn in them."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from hashlib import sha256
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.report.figures import ReportFigure, data_digest, figures_of
from tests.unit.experiments.report.made_up import cell, experiment, row, share
from tests.unit.experiments.support.common import groups, marks


def drawn(one: dict[str, Any], variant: str = "") -> str:
    return ReportFigure("f", "made up", one, variant).svg


def texts(svg: str) -> list[str]:
    """Every text of a figure, in the order drawn."""
    return ["".join(one.itertext()) for one in ET.fromstring(svg).findall(".//{*}text")]  # noqa: S314 - our own


def places(svg: str, name: str) -> list[tuple[float, float]]:
    return [(float(one.get("x", "")), float(one.get("y", ""))) for one in marks(svg, name)]


A, B = (
    row(f"4/{name}", {"success": share(at, at + 5.0)}, labels=[name])
    for name, at in (("a", 40.0), ("b", 80.0))
)


def test_an_experiment_has_its_figure_and_one_for_each_variant_with_panels() -> None:
    at = [
        row(f"8/{variant}/{at}", {}, variant=variant, at=at)
        for variant in ("x", "y")
        for at in ("0.1", "0.2")
    ]
    one = experiment(*at, A, number=8, drawn=["steps"], figure="sweep")
    assert [(figure.name, figure.title, figure.variant) for figure in figures_of(one)] == [
        ("experiment-8-x", "made up: x", "x"),
        ("experiment-8-y", "made up: y", "y"),
        ("experiment-8", "made up", ""),
    ]
    assert list(figures_of(experiment(A))) == []
    assert [figure.name for figure in figures_of(experiment(*at, figure="sweep"))] == ["experiment-4"]


def test_a_figure_names_what_it_shows_and_its_data() -> None:
    one = experiment(A, figure="intervals", title="x")
    svg = ReportFigure("f", "a <b>", one).svg
    assert svg.startswith('<svg role="img" ')
    assert "<title>a &lt;b&gt;</title><desc>Matplotlib " in svg
    digest = sha256(json.dumps(one, sort_keys=True).encode()).hexdigest()
    assert data_digest(one) == digest
    assert f", data {digest}</desc>" in svg
    assert svg == ReportFigure("f", "a <b>", one).svg


def test_intervals_have_a_point_for_each_row_and_a_line_for_what_is_exact() -> None:
    silent = row("4/c", {"success": share(20.0)}, labels=["c"])
    other = row("4/d", {"steps": cell(1.0)}, labels=["d"])
    of_paper = row("4/e", {"success": share(20.0, paper=30.0)}, labels=["e", "f"])
    svg = drawn(experiment(A, B, silent, other, of_paper, figure="intervals"))
    (a, b, c, e) = places(svg, "measured")
    assert a[0] < b[0]
    assert c[0] == e[0] < a[0]
    assert a[1] < b[1] < c[1] < e[1]  # the first is on top
    exact_a, exact_b = places(svg, "exact")
    assert exact_a[1] == a[1]
    assert exact_b[0] - b[0] == pytest.approx(exact_a[0] - a[0])
    ((paper, _),) = places(svg, "paper")
    assert c[0] < paper < a[0]
    found = texts(svg)
    assert {"a", "b", "c", "e, f", "success, %", "measured, with 95 % interval", "exact", "paper"} <= set(
        found
    )
    assert "d" not in found


def test_a_sign_that_is_not_drawn_is_not_explained() -> None:
    found = texts(drawn(experiment(row("4/c", {"success": share(20.0)}), figure="intervals")))
    assert "measured, with 95 % interval" in found
    assert not {"exact", "paper", "exact if attempts were independent"} & set(found)


def _mean(variant: str, at: str, measured: float, exact: float | None, **more: Any) -> dict[str, Any]:
    return {
        "title": variant,
        "variant": variant,
        "at": at,
        "along": "rate",
        "cell": share(measured, exact, **more),
        "why": [],
        "unexplained": [],
    }


def test_a_sweep_has_a_line_for_each_variant_along_what_is_varied() -> None:
    means = [
        _mean("x", "0.10", 90.0, 90.0, independent=95.0),
        _mean("x", "0.9", 10.0, 10.0, independent=20.0),
        _mean("y", "0.10", 80.0, None),
        _mean("y", "0.9", 5.0, 6.0, paper=7.0),
    ]
    svg = drawn(experiment(A, means=means, figure="sweep"))
    assert len(marks(svg, "measured")) == 4
    assert len(groups(svg, "exact")) == 1  # of y one value is unknown
    assert len(groups(svg, "independent")) == 1
    assert len(marks(svg, "paper")) == 1
    assert {"0.10", "0.9", "rate", "x", "y", "success, mean over tasks, %"} <= set(texts(svg))
    x1, x2, y1, y2 = places(svg, "measured")
    assert x1[0] < y1[0] < x2[0] < y2[0]  # side by side
    assert x1[1] < y1[1]  # more is higher


def test_a_sweep_of_which_single_rows_ran_shows_their_intervals() -> None:
    assert "success, %" in texts(drawn(experiment(A, B, figure="sweep")))


def test_panels_show_the_chosen_metrics_of_one_variant() -> None:
    rows = [
        row(
            f"8/x/{at}",
            {"success": share(50.0, 55.0), "steps": cell(4.0)},
            variant="x",
            at=at,
            along="rate",
            labels=["pipe", "", at],
        )
        for at in ("0.1", "0.2", "0.3")
    ]
    other = row("8/y/0.1", {"success": share(1.0)}, variant="y", at="0.1")
    svg = drawn(experiment(*rows, other, drawn=["success", "steps", "none"], number=8), "x")
    assert len(marks(svg, "measured")) == 6
    assert len(marks(svg, "exact")) == 3
    found = texts(svg)
    assert {"success, %", "steps", "0.1", "0.2", "0.3", "rate", "pipe"} <= set(found)


def _layer(module: str, layer: str, violated: float, worst: float, **more: float) -> dict[str, Any]:
    cells = {"violated": violated, "worst": worst, **more}
    return row(
        f"9/{module}/{layer}", {name: cell(value) for name, value in cells.items()}, labels=[module, layer]
    )


def test_layers_say_what_was_violated_behind_each() -> None:
    rows = [
        _layer("knife", "open", 100.0, 0.71234),
        _layer("knife", "both", 0.0, 0.0, installed=0.0),
        _layer("gentle", "open", 0.0, 0.25),
        _layer("gentle", "both", 0.0, 0.25, installed=100.0),
    ]
    svg = drawn(experiment(*rows, figure="layers"))
    found = texts(svg)
    assert {"knife", "gentle", "open", "both"} <= set(found)
    assert found.count("not installed") == 1
    assert found.count("100 % violated, 0.712") == 1
    assert found.count("0 % violated, 0.25") == 2
    assert (svg.count("fill: #ffcdd2"), svg.count("fill: #c8e6c9")) == (1, 3)


def test_series_are_drawn_session_by_session() -> None:
    series = {
        "best": {"measured": None, "exact": [1.0, 1.0, 0.5]},
        "success": {"measured": [1.0, 0.0, 0.5], "exact": [0.9, 0.1, 0.5]},
        "tries": {"measured": [1, 1, 2], "exact": None},
    }
    rows = [row(f"11/{name}", {}, series=series, labels=[name]) for name in ("on", "off")]
    svg = drawn(experiment(*rows, number=11, figure="series"))
    assert len(marks(svg, "mean")) == 2 * 2 * 3
    assert len(groups(svg, "exact")) == 2
    assert len(groups(svg, "best")) == 1
    assert {"success by session", "tries by session", "on", "off", "of one who knows the chances"} <= set(
        texts(svg)
    )


def test_times_over_the_number_of_modules_have_logarithmic_axes() -> None:
    metrics = {
        "lookup_us": {"title": "lookup, us", "share": False},
        "load_s": {"title": "load, s", "share": False},
        "count": {"title": "count", "share": False},
    }
    rows = [
        row(
            f"10/{count}",
            {
                "lookup_us": cell(100.0 * count),
                "load_s": {**cell(float(count)), "low": 0.0},  # no logarithm
                "count": cell(1.0),
            },
            variant=str(count),
        )
        for count in (1, 10, 100)
    ]
    svg = drawn(experiment(*rows, metrics=metrics, number=10, figure="scale"))
    at = places(svg, "measured")
    assert len(at) == 3
    assert at[1][0] - at[0][0] == pytest.approx(at[2][0] - at[1][0], abs=0.01)
    assert at[0][1] - at[1][1] == pytest.approx(at[1][1] - at[2][1], abs=0.01)
    found = texts(svg)
    assert {"lookup", "modules", "seconds of processor", "0.0001", "0.01"} <= set(found)
    assert "count" not in found
