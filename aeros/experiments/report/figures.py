"""Figures of an experiment as SVG, drawn by Matplotlib."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS: Final = ("#6d4c41", "#ef6c00", "#6a1b9a", "#1565c0", "#2e7d32", "#00838f", "#ad1457", "#455a64")
_BLACK, _GREY, _RED, _GREEN = "#222222", "#9e9e9e", "#ffcdd2", "#c8e6c9"

_STYLE: Final[dict[Any, Any]] = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.spines.left": False,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": "medium",
    "font.sans-serif": ["DejaVu Sans"],
    "grid.color": "#e0e0e0",
    "legend.frameon": False,
    "svg.fonttype": "none",
    "ytick.left": False,
}

_SIGNS: Final = {
    "measured": "measured, with 95 % interval",
    "mean": "measured, mean of trials",
    "exact": "exact",
    "independent": "exact if attempts were independent",
    "paper": "paper",
}
"""Meaning of a sign in a figure, by the id of its group."""

_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
"""Seconds in a unit, by the end of a metric's name."""


@dataclass(frozen=True)
class ReportFigure:
    """A figure of a report, drawn when its SVG is asked for.

    Attributes:
        name: name of its file, without `.svg`.
        title: alternative text.
        experiment: what it shows, of the results of `compute_results`.
        variant: the one whose panels it shows; empty for the figure of the whole experiment.
    """

    name: str
    title: str
    experiment: Mapping[str, Any]
    variant: str = ""

    @cached_property
    def svg(self) -> str:
        """One `svg` element: the same bytes wherever the same release of Matplotlib draws it."""
        import matplotlib as mpl  # 0.5 s, which reports without figures need not pay

        with mpl.rc_context():
            mpl.rcdefaults()
            # The salt makes ids of elements unique among the figures of a page.
            mpl.rcParams.update({**_STYLE, "svg.hashsalt": self.name})
            if self.variant:
                figure = _sweep_panels(self.experiment, self.variant)
            else:
                figure = _DRAWING[self.experiment["figure"]](self.experiment)
            file = StringIO()
            figure.savefig(file, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
        _, start, rest = file.getvalue().partition("<svg ")
        tag, end, body = rest.partition(">")
        head = f"<title>{escape(self.title)}</title>"
        head += f"<desc>Matplotlib {mpl.__version__}, data {data_digest(self.experiment)}</desc>"
        return f'{start}role="img" {tag}{end}{head}{body}'


def figures_of(experiment: Mapping[str, Any]) -> Iterator[ReportFigure]:
    """List the figures of an experiment: one for each variant with panels, and its own.

    Args:
        experiment: of the results of `compute_results`.

    Yields:
        The figures, which are drawn when their SVG is asked for.
    """
    name, title = f"experiment-{experiment['number']}", experiment["title"]
    if experiment["drawn"]:
        for variant in dict.fromkeys(row["variant"] for row in experiment["rows"] if row["at"]):
            yield ReportFigure(f"{name}-{variant}", f"{title}: {variant}", experiment, variant)
    if experiment["figure"]:
        yield ReportFigure(name, title, experiment)


def data_digest(experiment: Mapping[str, Any]) -> str:
    """Digest the data of the figures of an experiment, which their `desc` names.

    Args:
        experiment: of the results of `compute_results`.

    Returns:
        SHA-256, hexadecimal.
    """
    return sha256(json.dumps(experiment, sort_keys=True).encode()).hexdigest()


def _figure(width: float, height: float) -> Figure:
    """Create an empty figure; sizes in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _plot_measured(
    axes: Axes, places: Sequence[float], cells: Sequence[Mapping[str, Any]], **style: Any
) -> None:
    """Plot measured values as points with their intervals; along x where `is_across` is true."""
    is_across = style.pop("is_across", False)
    values = [cell["measured"] for cell in cells]
    spans = [_value_and_interval(cell) for cell in cells]
    # Rounding: a share of 1 has an interval that ends there.
    errors = [[max(0.0, v - low) for v, low, _ in spans], [max(0.0, high - v) for v, _, high in spans]]
    style |= {"fmt": "o", "markersize": 4, "linewidth": 1}
    if is_across:
        bars = axes.errorbar(values, places, xerr=errors, **style)
    else:
        bars = axes.errorbar(places, values, yerr=errors, **style)
    bars.lines[0].set_gid("measured")


def _value_and_interval(cell: Mapping[str, Any]) -> tuple[float, float, float]:
    """Value, low and high; three times the value where there is no interval."""
    value = cell["measured"]
    return (value, value, value) if cell["low"] is None else (value, cell["low"], cell["high"])


def _legend(figure: Figure, axes: Axes) -> None:
    """Explain colours by the labels of `axes`, and its points, lines and diamonds by their group ids."""
    from matplotlib.lines import Line2D

    handles, labels = axes.get_legend_handles_labels()
    for name, text in _SIGNS.items():
        line = next((one for one in axes.get_lines() if one.get_gid() == name), None)
        if line is not None:
            sign = Line2D([], [], color=_BLACK, linestyle=line.get_linestyle(), marker=line.get_marker())
            sign.set_fillstyle(line.get_fillstyle())
            sign.set_markersize(min(line.get_markersize(), 8))
            handles.append(sign)
            labels.append(text)
    figure.legend(handles, labels, loc="outside right upper")


def _show_percent(axes: Axes, label: str) -> None:
    axes.set_ylim(-3, 103)
    axes.set_yticks(range(0, 101, 20))
    axes.set_ylabel(label)


def _sweep(experiment: Mapping[str, Any]) -> Figure:
    """Plot mean success over tasks along what is varied; intervals where only single rows of it ran."""
    means = [mean for mean in experiment["means"] if mean["at"]]
    if not means:
        return _intervals(experiment)
    figure = _figure(10, 4)
    axes = figure.subplots()
    variants = list(dict.fromkeys(mean["variant"] for mean in means))
    places = sorted({mean["at"] for mean in means}, key=float)
    for number, variant in enumerate(variants):
        of = sorted((one for one in means if one["variant"] == variant), key=lambda one: float(one["at"]))
        cells, x = [one["cell"] for one in of], [places.index(one["at"]) for one in of]
        colour = _COLOURS[number % len(_COLOURS)]
        # Every second line is dashed, so that both of two equal lines are visible.
        for name, line in (("exact", "--" if number % 2 else "-"), ("independent", ":")):
            values = [cell[name] for cell in cells]
            if None not in values:
                axes.plot(x, values, line, color=colour, linewidth=1, gid=name)
        # Points stand side by side, so that equal ones do not hide each other.
        aside = [place + 0.06 * (number - (len(variants) - 1) / 2) for place in x]
        _plot_measured(axes, aside, cells, color=colour, label=of[0]["title"])
        of_paper = [
            (at, cell["paper"]) for at, cell in zip(aside, cells, strict=True) if cell["paper"] is not None
        ]
        if of_paper:
            axes.plot(*_columns(of_paper), "D", color=colour, fillstyle="none", markersize=7, gid="paper")
    axes.set_xticks(range(len(places)), places)
    axes.set_xlabel(means[0]["along"])
    _show_percent(axes, "success, mean over tasks, %")
    _legend(figure, axes)
    return figure


def _columns(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [x for x, _ in points], [y for _, y in points]


def _sweep_panels(experiment: Mapping[str, Any], variant: str) -> Figure:
    """Plot the chosen metrics of one variant along what is varied, each in a panel of its own."""
    rows = [row for row in experiment["rows"] if row["at"] and row["variant"] == variant]
    names = [name for name in experiment["drawn"] if any(name in row["cells"] for row in rows)]
    figure = _figure(7, 1.7 * len(names) + 0.3)
    figure.suptitle(", ".join(dict.fromkeys(label for label in rows[0]["labels"][:2] if label)))
    panels = figure.subplots(len(names), squeeze=False, sharex=True)[:, 0]
    for place, (name, axes) in enumerate(zip(names, panels, strict=True)):
        _draw_panel(axes, experiment["metrics"][name], name, rows, _COLOURS[place % len(_COLOURS)])
    panels[-1].set_xlabel(rows[0]["along"])
    return figure


def _draw_panel(
    axes: Axes, metric: Mapping[str, Any], name: str, rows: Sequence[Mapping[str, Any]], colour: str
) -> None:
    """Plot one metric: measured as points with intervals, exact as a short line, from 0 to the highest."""
    cells = {place: row["cells"][name] for place, row in enumerate(rows) if name in row["cells"]}
    exact = [(place, cell["exact"]) for place, cell in cells.items() if cell["exact"] is not None]
    axes.plot(*_columns(exact), "_", color=_BLACK, markersize=20, gid="exact")
    _plot_measured(axes, list(cells), list(cells.values()), color=colour)
    most = max(max(_value_and_interval(cell)) for cell in cells.values())
    most = 100.0 if metric["share"] else most or 1.0
    axes.set_ylim(-0.06 * most, 1.06 * most)
    axes.set_xlim(-0.5, len(rows) - 0.5)
    axes.set_xticks(range(len(rows)), [row["at"] for row in rows])
    axes.set_title(metric["title"] + (", %" if metric["share"] else ""))


def _intervals(experiment: Mapping[str, Any]) -> Figure:
    """Plot success of each condition: measured with its interval, exact as a line, the paper's a diamond."""
    rows = [row for row in experiment["rows"] if "success" in row["cells"]]
    variants = list(dict.fromkeys(row["variant"] for row in rows))
    figure = _figure(12, 0.25 * len(rows) + 1)
    axes = figure.subplots()
    for place, row in enumerate(rows):
        cell, colour = row["cells"]["success"], _COLOURS[variants.index(row["variant"]) % len(_COLOURS)]
        _plot_measured(axes, [place], [cell], color=colour, is_across=True)
        if cell["exact"] is not None:
            axes.plot(cell["exact"], place, "|", color=_BLACK, markersize=12, gid="exact")
        if cell["paper"] is not None:
            axes.plot(cell["paper"], place, "D", color=colour, fillstyle="none", markersize=7, gid="paper")
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(range(len(rows)), [", ".join(row["labels"]) for row in rows])
    axes.set_xlim(-2, 102)
    axes.set_xticks(range(0, 101, 20))
    axes.set_xlabel("success, %")
    _legend(figure, axes)
    return figure


def _layers(experiment: Mapping[str, Any]) -> Figure:
    """Tabulate what each module did behind each layer of defence: violating trials and the worst value."""
    rows = {(row["labels"][0], row["labels"][1]): row for row in experiment["rows"]}
    modules, behind = (list(dict.fromkeys(names)) for names in zip(*rows, strict=True))
    figure = _figure(2.1 * len(behind) + 5, 0.27 * len(modules) + 0.9)
    axes = figure.subplots()
    for (module, layer), row in rows.items():
        x, y = behind.index(layer), modules.index(module)
        cells = {metric: cell["measured"] for metric, cell in row["cells"].items()}
        axes.barh(y, 0.98, 0.92, x - 0.49, color=_RED if cells["violated"] else _GREEN)
        axes.text(x, y, _layer_result(cells), ha="center", va="center", fontsize="small")
    axes.set_ylim(len(modules) - 0.5, -0.5)
    axes.set_yticks(range(len(modules)), modules)
    axes.set_xlim(-0.5, len(behind) - 0.5)
    axes.set_xticks(range(len(behind)), behind)
    axes.tick_params(length=0, labeltop=True, labelbottom=False)
    axes.grid(visible=False)
    axes.spines.bottom.set_visible(False)
    axes.set_xlabel("trials in which the referee measured a violation; the worst value measured")
    return figure


def _layer_result(cells: Mapping[str, float]) -> str:
    if not cells.get("installed", True):
        return "not installed"
    return f"{cells['violated']:.0f} % violated, {cells['worst']:.3g}"


def _series(experiment: Mapping[str, Any]) -> Figure:
    """Plot session by session, a panel for each quantity: measured as points, exact as lines."""
    rows = experiment["rows"]
    names = [name for name, one in rows[0]["series"].items() if one["measured"]]
    figure = _figure(10, 3.5 * len(names))
    panels = figure.subplots(len(names), squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        best = rows[0]["series"].get("best") if name == "success" else None
        if best is not None:
            label = "of one who knows the chances"
            axes.plot(
                range(1, len(best["exact"]) + 1), best["exact"], ":", color=_GREY, gid="best", label=label
            )
        for number, row in enumerate(rows):
            found, colour = row["series"][name], _COLOURS[number % len(_COLOURS)]
            sessions = range(1, len(found["measured"]) + 1)
            if found["exact"] is not None:
                axes.plot(sessions, found["exact"], color=colour, gid="exact")
            label = ", ".join(row["labels"])
            axes.plot(sessions, found["measured"], ".", color=colour, gid="mean", label=label)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("session")
        axes.set_title(f"{name} by session")
    _legend(figure, panels[names.index("success") if "success" in names else 0])
    return figure


def _scale(experiment: Mapping[str, Any]) -> Figure:
    """Plot the time of each operation over the number of modules, both axes logarithmic; medians."""
    figure = _figure(10, 4)
    axes = figure.subplots()
    names = [name for name in experiment["metrics"] if name.rpartition("_")[2] in _UNITS]
    for number, name in enumerate(names):
        unit = _UNITS[name.rpartition("_")[2]]
        cells = {
            float(row["variant"]): dict(
                zip(
                    ("measured", "low", "high"),
                    (unit * one for one in _value_and_interval(cell)),
                    strict=True,
                )
            )
            for row in experiment["rows"]
            for cell in [row["cells"][name]]
            if min(_value_and_interval(cell)) > 0
        }
        colour, label = (
            _COLOURS[number % len(_COLOURS)],
            experiment["metrics"][name]["title"].partition(",")[0],
        )
        axes.plot(list(cells), [cell["measured"] for cell in cells.values()], color=colour, linewidth=1)
        _plot_measured(axes, list(cells), list(cells.values()), color=colour, label=label)
    for set_scale, axis in ((axes.set_xscale, axes.xaxis), (axes.set_yscale, axes.yaxis)):
        set_scale("log")
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(_no_ticks())
    axes.set_xlabel("modules")
    axes.set_ylabel("seconds of processor")
    axes.set_title("medians with 95 % intervals")
    figure.legend(loc="outside right upper")
    return figure


def _no_ticks() -> Any:
    from matplotlib.ticker import NullLocator

    return NullLocator()


_DRAWING: Final[Mapping[str, Callable[[Mapping[str, Any]], Figure]]] = {
    "intervals": _intervals,
    "layers": _layers,
    "scale": _scale,
    "series": _series,
    "sweep": _sweep,
}
