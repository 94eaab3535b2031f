"""Every figure in full, as text: sizes, axes, ticks, and each line, bar and text with its place and style.

The expected text is `figures.txt`.  It does not depend on how a release of Matplotlib writes SVG.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="needs `pip install '.[experiments]'`")

import matplotlib as mpl
from matplotlib.colors import to_hex

from aeros.experiments.report import figures
from tests.reports_in_full import compare_with_section
from tests.unit.experiments.report.made_up import cell, experiment, row, share

EXPECTED = Path(__file__).with_name("figures.txt")

INTERVALS = experiment(
    row("4/a", {"success": share(40.0, 45.0, paper=47.5)}, labels=["flat", "table"]),
    row("4/b", {"success": share(100.0, high=99.5)}, labels=["tree", "dumplings"], variant="tree"),
    row("4/c", {"success": share(0.0, low=None)}, labels=["tree", "table"], variant="tree"),
    row("4/d", {"steps": cell(3.0)}, labels=["none"]),
)
SWEEP = experiment(
    means=[
        {"variant": variant, "title": f"the {variant}", "at": at, "along": "rate, %", "cell": one}
        for variant, cells in {
            "flat": {"10": share(30.0, 35.0, independent=36.0), "5": share(60.0, 62.5, independent=64.0)},
            "tree": {"5": share(90.0, 91.0, paper=93.0), "10": share(80.0, 81.0)},
        }.items()
        for at, one in cells.items()
    ]
)
PANELS = experiment(
    *(
        row(
            f"8/slow/{at}",
            {"success": share(50.0, 55.0), **steps},
            variant="slow",
            at=at,
            along="latency, s",
            labels=["slow planner", "table", ""],
        )
        for at, steps in (("0.1", {"steps": cell(3.0, 3.5)}), ("2", {"steps": cell(40.0)}), ("5", {}))
    ),
    row("8/other/0.1", {"success": share(1.0)}, variant="other", at="0.1"),
    drawn=["success", "steps", "stops"],
    metrics={
        "success": {"title": "success", "share": True},
        "steps": {"title": "steps of a trial", "share": False},
        "stops": {"title": "stops", "share": False},
    },
)
LAYERS = experiment(
    *(
        row(
            f"6/{module}/{layer}",
            {name: cell(value) for name, value in cells.items()},
            labels=[module, layer],
        )
        for module, layer, cells in (
            ("rusher", "all", {"installed": 0.0, "violated": 0.0, "worst": 0.0}),
            ("rusher", "no gate", {"installed": 100.0, "violated": 87.5, "worst": 1.23456}),
            ("flood", "all", {"violated": 0.0, "worst": 0.25}),
        )
    )
)
SERIES = experiment(
    *(
        row(
            f"15/{name}",
            {},
            labels=[name, "with memory"],
            series={
                "success": {"measured": [50.0, 75.0, 80.0], "exact": exact},
                "tries": {"measured": [2.0, 1.5, 1.25], "exact": None},
                "best": {"measured": None, "exact": [90.0, 90.0, 90.0]},
            },
        )
        for name, exact in (("thompson", [55.0, 70.0, 85.0]), ("greedy", None))
    )
)
SCALE = experiment(
    *(
        row(
            f"9/{count}",
            {
                "install_s": cell(time, low=time / 2, high=2 * time),
                "decide_us": cell(20.0),
                "size": cell(1.0),
            },
            variant=count,
        )
        for count, time in (("10", 0.5), ("1000", 40.0), ("1", 0.0))
    ),
    metrics={
        "install_s": {"title": "install, s", "share": False},
        "decide_us": {"title": "decide, µs", "share": False},
        "size": {"title": "size", "share": False},
    },
)


def _numbers(values: Any) -> str:
    return " ".join(f"{float(value):.6g}" for value in values)


def _shown_axes(axes: Any) -> Iterator[str]:
    yield f"axes {axes.get_title(loc='left') or axes.get_title()!r}"
    for name, axis, limits in (("x", axes.xaxis, axes.get_xlim()), ("y", axes.yaxis, axes.get_ylim())):
        ticks = [one.get_text() for one in axis.get_ticklabels()]
        yield f"  {name}: {_numbers(limits)}, {axis.get_scale()}, {axis.get_label().get_text()!r}"
        yield f"    ticks {_numbers(axis.get_ticklocs())}: {ticks}; {len(axis.get_minorticklocs())} minor"
        yield f"    shown {sorted(axis.get_tick_params().items())}"
    yield f"  bottom spine {axes.spines.bottom.get_visible()}"
    for line in axes.get_lines():
        style = f"{line.get_linestyle()} {line.get_linewidth():g} {to_hex(line.get_color())}"
        marker = f"{line.get_marker()} {line.get_markersize():g} {line.get_fillstyle()}"
        label = "" if str(line.get_label()).startswith("_") else line.get_label()
        yield f"  line {line.get_gid()} {label!r} {style} marker {marker}"
        yield f"    {_numbers(line.get_xdata())} / {_numbers(line.get_ydata())}"
    for one in axes.collections:
        for segment in one.get_segments():
            style = f"{one.get_linewidth()[0]:g} {to_hex(one.get_color()[0])}"
            yield f"  interval {_numbers(segment.ravel())} {style}"
    for bar in axes.patches:
        yield f"  bar {_numbers(bar.get_bbox().bounds)} {to_hex(bar.get_facecolor())}"
    for text in axes.texts:
        place = _numbers(text.get_position())
        yield f"  text {text.get_text()!r} {place} {text.get_ha()} {text.get_va()} {text.get_fontsize():.4g}"


def _shown(figure: Any) -> Iterator[str]:
    figure.canvas.draw()
    layout = type(figure.get_layout_engine()).__name__
    yield f"figure {_numbers(figure.get_size_inches())} {figure.get_suptitle()!r} {layout}"
    for legend in figure.legends:
        yield f"legend {legend._outside_loc}"
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
            style = [
                getattr(handle, f"get_{name}", str)()
                for name in ("linestyle", "marker", "markersize", "fillstyle", "color")
            ]
            yield f"  {text.get_text()!r} {style if hasattr(handle, 'get_marker') else ''}"
    for axes in figure.axes:
        yield from _shown_axes(axes)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("intervals", INTERVALS),
        ("sweep", SWEEP),
        ("layers", LAYERS),
        ("series", SERIES),
        ("scale", SCALE),
    ],
)
def test_a_figure_of_each_kind(name: str, given: dict[str, Any]) -> None:
    with mpl.rc_context({**mpl.rcParamsDefault, **figures._STYLE, "backend": "agg"}):
        text = "\n".join(_shown(figures._DRAWING[name](given)))
    compare_with_section(EXPECTED, name, f"{text}\n")


def test_panels_of_one_variant() -> None:
    with mpl.rc_context({**mpl.rcParamsDefault, **figures._STYLE, "backend": "agg"}):
        text = "\n".join(_shown(figures._sweep_panels(PANELS, "slow")))
    compare_with_section(EXPECTED, "panels", f"{text}\n")


def test_the_style_is_that_of_all_figures() -> None:
    compare_with_section(
        EXPECTED, "style", "".join(f"{name}: {one}\n" for name, one in figures._STYLE.items())
    )
