"""Figures as SVG: what is varied, conditions with intervals, layers of defence, sessions, scale."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import escape
from math import ceil, floor, log10
from typing import Any, Final

_COLOURS: Final = ("#6d4c41", "#ef6c00", "#6a1b9a", "#1565c0", "#2e7d32", "#00838f", "#ad1457", "#455a64")

_LEFT, _TOP, _WIDE, _HIGH = 60, 20, 640, 320
_LABELS, _LINE = 470, 20
_PANEL = 110


def sweep(one: Mapping[str, Any]) -> str:
    """Mean success over tasks along what is varied: exact as lines, measured as points with intervals."""
    means = [mean for mean in one["means"] if mean["at"]]
    if not means:  # some rows of it alone
        return intervals(one)
    variants = list(dict.fromkeys(mean["variant"] for mean in means))
    places = sorted({mean["at"] for mean in means}, key=float)
    x_of = {at: _LEFT + _WIDE * (place + 1) / (len(places) + 1) for place, at in enumerate(places)}
    parts = list(_grid(x_of))
    for number, variant in enumerate(variants):
        colour = _COLOURS[number % len(_COLOURS)]
        of = sorted(
            (mean for mean in means if mean["variant"] == variant), key=lambda mean: float(mean["at"])
        )
        # Dashed now and then: of two that lie on each other both are seen.
        parts += _line(of, "exact", x_of, colour, f"{4 + 2 * number}" if number % 2 else "")
        parts += _line(of, "independent", x_of, colour, "1 4")
        # Side by side, as several of them may lie on each other.
        aside = 4 * (number - (len(variants) - 1) / 2)
        for mean in of:
            cell, x = mean["cell"], x_of[mean["at"]] + aside
            parts.append(_bar(x, _y(cell["low"]), x, _y(cell["high"]), colour))
            parts.append(f'<circle cx="{x:.1f}" cy="{_y(cell["measured"]):.1f}" r="3" fill="{colour}"/>')
            if cell["paper"] is not None:
                parts.append(_diamond(x, _y(cell["paper"]), colour))
        label_y = _TOP + 16 + 18 * number
        parts.append(
            f'<rect x="{_LEFT + _WIDE + 16}" y="{label_y - 9}" width="12" height="9" fill="{colour}"/>'
        )
        parts.append(_text(_LEFT + _WIDE + 34, label_y, of[0]["title"]))
    parts.append(_text(_LEFT + _WIDE / 2, _TOP + _HIGH + 38, means[0]["along"], "middle"))
    told = "success, mean over tasks, %; line: exact, ◇: paper"
    if any(mean["cell"]["independent"] is not None for mean in means):
        told += ", dotted: if attempts were independent"
    parts.append(_text(_LEFT, _TOP - 6, told))
    return _svg(
        _LEFT + _WIDE + 270, _TOP + _HIGH + 50, f"{one['title']}: success along what is varied", parts
    )


def _line(
    of: Sequence[Mapping[str, Any]], name: str, x_of: Mapping[str, float], colour: str, dashes: str
) -> Iterator[str]:
    """Through what was computed, where that is known everywhere."""
    values = [mean["cell"][name] for mean in of]
    if None not in values:
        points = " ".join(
            f"{x_of[mean['at']]:.1f},{_y(value):.1f}" for mean, value in zip(of, values, strict=True)
        )
        dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
        yield f'<polyline points="{points}" fill="none" stroke="{colour}"{dashed}/>'


def along(one: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """For each variant, its name and the metrics that are drawn along what is varied, each in a panel."""
    rows = [row for row in one["rows"] if row["at"] and one["drawn"]]
    for variant in dict.fromkeys(row["variant"] for row in rows):
        of = [row for row in rows if row["variant"] == variant]
        names = [name for name in one["drawn"] if any(name in row["cells"] for row in of)]
        parts = [
            part
            for place, name in enumerate(names)
            for part in _panel(one["metrics"][name], name, of, _COLOURS[place % len(_COLOURS)], place)
        ]
        title = ", ".join(dict.fromkeys(label for label in of[0]["labels"][:2] if label))
        parts.append(_text(_LEFT, _TOP - 6, title))
        high = (_PANEL + 70) * len(names) + _TOP
        yield variant, _svg(_LEFT + _WIDE + 40, high, f"{one['title']}: {title}", parts)


def _panel(
    metric: Mapping[str, Any], name: str, rows: Sequence[Mapping[str, Any]], colour: str, place: int
) -> Iterator[str]:
    """One metric: measured as points with intervals, exact as a short line, from 0 to the highest."""
    top = _TOP + 20 + (_PANEL + 70) * place
    cells = [row["cells"].get(name) for row in rows]
    known = [
        value for cell in cells if cell for value in (cell["high"], cell["measured"]) if value is not None
    ]
    most = 100.0 if metric["share"] else max(known) or 1.0
    step = _WIDE / len(rows)

    def y(value: float) -> float:
        return top + _PANEL * (1 - value / most)

    for share in (0.0, 0.5, 1.0):
        yield _bar(_LEFT, y(share * most), _LEFT + _WIDE, y(share * most), "#e0e0e0")
        yield _text(_LEFT - 8, y(share * most) + 4, f"{share * most:.3g}", "end")
    yield _text(_LEFT, top - 6, metric["title"] + (", %" if metric["share"] else ""))
    for number, (row, cell) in enumerate(zip(rows, cells, strict=True)):
        x = _LEFT + step * (number + 0.5)
        yield _text(x, top + _PANEL + 16, row["at"], "middle")
        if cell is None:
            continue
        if cell["low"] is not None:
            yield _bar(x, y(cell["low"]), x, y(cell["high"]), colour)
        if cell["exact"] is not None:
            yield _bar(x - 10, y(cell["exact"]), x + 10, y(cell["exact"]), "#222")
        yield f'<circle cx="{x:.1f}" cy="{y(cell["measured"]):.1f}" r="4" fill="{colour}"/>'
    yield _text(_LEFT + _WIDE / 2, top + _PANEL + 34, rows[0]["along"], "middle")


def intervals(one: Mapping[str, Any]) -> str:
    """Success of each condition: interval and point measured, exact as a line, the paper's as a diamond."""
    rows = [row for row in one["rows"] if "success" in row["cells"]]
    variants = list(dict.fromkeys(row["variant"] for row in rows))
    high = _LINE * len(rows)
    parts = []
    for share in range(0, 101, 20):
        x = _LABELS + _WIDE * share / 100
        parts.append(_bar(x, 0, x, high, "#e0e0e0"))
        parts.append(_text(x, high + 16, f"{share} %", "middle"))
    for number, row in enumerate(rows):
        cell, y = row["cells"]["success"], _LINE * (number + 0.5)
        colour = _COLOURS[variants.index(row["variant"]) % len(_COLOURS)]
        at = {name: _LABELS + _WIDE * cell[name] / 100 for name in ("low", "high", "measured")}
        parts.append(_text(_LABELS - 10, y + 4, ", ".join(row["labels"]), "end"))
        parts.append(_bar(at["low"], y, at["high"], y, colour))
        parts.append(f'<circle cx="{at["measured"]:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')
        if cell["exact"] is not None:
            exact = _LABELS + _WIDE * cell["exact"] / 100
            parts.append(_bar(exact, y - 8, exact, y + 8, "#222"))
        if cell["paper"] is not None:
            parts.append(_diamond(_LABELS + _WIDE * cell["paper"] / 100, y, colour))
    parts.append(_text(_LABELS, high + 34, "success; dot and bar: measured, 95 %; line: exact; ◇: paper"))
    return _svg(_LABELS + _WIDE + 30, high + 44, f"{one['title']}: success", parts)


def layers(one: Mapping[str, Any]) -> str:
    """What each module came to behind each layer: how many trials violated something, and the worst."""
    of = {(row["labels"][0], row["labels"][1]): row for row in one["rows"]}
    modules, behind = (list(dict.fromkeys(names)) for names in zip(*of, strict=True))
    wide, high = 200, 26
    left = 560
    parts = [_text(left + wide * (x + 0.5), 16, name, "middle") for x, name in enumerate(behind)]
    for y, module in enumerate(modules):
        parts.append(_text(left - 10, 24 + high * (y + 0.65), module, "end"))
        for x, name in enumerate(behind):
            row = of.get((module, name))
            if row is None:
                continue
            cells = {metric: cell["measured"] for metric, cell in row["cells"].items()}
            colour = "#ffcdd2" if cells["violated"] else "#c8e6c9"
            size = f'x="{left + wide * x + 1}" y="{24 + high * y + 1}" width="{wide - 2}" height="{high - 2}"'
            parts.append(f'<rect {size} fill="{colour}"/>')
            parts.append(_text(left + wide * (x + 0.5), 24 + high * (y + 0.65), _came_to(cells), "middle"))
    foot = 24 + high * len(modules) + 20
    parts.append(
        _text(left, foot, "trials in which the referee measured a violation; the worst that he measured")
    )
    return _svg(left + wide * len(behind) + 20, foot + 14, one["title"], parts)


def _came_to(cells: Mapping[str, float]) -> str:
    if not cells.get("installed", True):
        return "not installed"
    return f"{cells['violated']:.0f} % violated, {cells['worst']:.3g}"


def series(one: Mapping[str, Any]) -> str:
    """What was measured in each session as points, what is exact as lines, a part for each quantity."""
    names = [name for name in one["rows"][0]["series"] if one["rows"][0]["series"][name]["measured"]]
    parts: list[str] = []
    for place, name in enumerate(names):
        parts += _part(one["rows"], name, place * (_HIGH + 70))
    for number, row in enumerate(one["rows"]):
        y = _TOP + 16 + 18 * number
        colour = _COLOURS[number % len(_COLOURS)]
        parts.append(f'<rect x="{_LEFT + _WIDE + 16}" y="{y - 9}" width="12" height="9" fill="{colour}"/>')
        parts.append(_text(_LEFT + _WIDE + 34, y, ", ".join(row["labels"])))
    title = f"{one['title']}: session by session"
    return _svg(_LEFT + _WIDE + 330, len(names) * (_HIGH + 70), title, parts)


def _part(rows: Sequence[Mapping[str, Any]], name: str, below: float) -> Iterator[str]:
    """One quantity of every row, the axis from 0 to the most there is."""
    measured = [row["series"][name]["measured"] for row in rows]
    most: int = max(1, *(ceil(value) for values in measured for value in values))
    count = len(measured[0])

    def x(session: int) -> float:
        return _LEFT + _WIDE * (session + 0.5) / count

    def y(value: float) -> float:
        return below + _TOP + _HIGH * (1 - value / most)

    def line(values: Sequence[float], style: str) -> str:
        points = " ".join(f"{x(place):.1f},{y(value):.1f}" for place, value in enumerate(values))
        return f'<polyline points="{points}" fill="none" {style}/>'

    for share in range(6):
        yield _bar(_LEFT, y(most * share / 5), _LEFT + _WIDE, y(most * share / 5), "#e0e0e0")
        yield _text(_LEFT - 8, y(most * share / 5) + 4, f"{most * share / 5:.3g}", "end")
    for session in range(0, count, max(1, count // 10)):
        yield _text(x(session), y(0) + 18, str(session + 1), "middle")
    best = rows[0]["series"].get("best") if name == "success" else None
    if best is not None:
        yield line(best["exact"], 'stroke="#9e9e9e" stroke-dasharray="2 4"')
    for number, row in enumerate(rows):
        found, colour = row["series"][name], _COLOURS[number % len(_COLOURS)]
        if found["exact"] is not None:
            yield line(found["exact"], f'stroke="{colour}" stroke-width="2"')
        for place, value in enumerate(found["measured"]):
            yield f'<circle cx="{x(place):.1f}" cy="{y(value):.1f}" r="2.5" fill="{colour}"/>'
    told = "; grey: of one who knows the chances" if best is not None else ""
    yield _text(_LEFT, below + _TOP - 6, f"{name} by session; points: measured, lines: exact{told}")


def scale(one: Mapping[str, Any]) -> str:
    """What each quantity takes against how many modules there are; both axes by powers of ten."""
    seconds = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
    names = [name for name in one["metrics"] if name.rpartition("_")[2] in seconds]
    found = {
        name: [
            (float(row["variant"]), [unit * value for value in _ends(row["cells"][name])])
            for row in one["rows"]
        ]
        for name in names
        for unit in [seconds[name.rpartition("_")[2]]]
    }
    sizes = [size for size, _ in found[names[0]]]
    times = [value for points in found.values() for _, values in points for value in values if value > 0]
    x, y = _log_axis(sizes, _LEFT, _WIDE), _log_axis(times, _TOP + _HIGH, -_HIGH)
    parts = []
    for power in range(-9, 6):
        for axis, among in ((x, sizes), (y, times)):
            if not _floor(min(among)) <= power <= -_floor(1 / max(among)):
                continue
            at = axis(10.0**power)
            if axis is x:
                parts.append(_text(at, _TOP + _HIGH + 18, f"{10.0**power:g}", "middle"))
            else:
                parts.append(_bar(_LEFT, at, _LEFT + _WIDE, at, "#e0e0e0"))
                parts.append(_text(_LEFT - 8, at + 4, f"{10.0**power:g}", "end"))
    for number, (name, points) in enumerate(found.items()):
        colour = _COLOURS[number % len(_COLOURS)]
        line = " ".join(f"{x(size):.1f},{y(values[0]):.1f}" for size, values in points if values[0] > 0)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}"/>')
        for size, (middle, low, high) in points:
            if low > 0:
                parts.append(_bar(x(size), y(low), x(size), y(high), colour))
                parts.append(f'<circle cx="{x(size):.1f}" cy="{y(middle):.1f}" r="3" fill="{colour}"/>')
        at = _TOP + 16 + 18 * number
        parts.append(f'<rect x="{_LEFT + _WIDE + 16}" y="{at - 9}" width="12" height="9" fill="{colour}"/>')
        title = one["metrics"][name]["title"].partition(",")[0]
        parts.append(_text(_LEFT + _WIDE + 34, at, title))
    parts.append(_text(_LEFT, _TOP - 6, "seconds of processor; medians with 95 % intervals"))
    parts.append(_text(_LEFT + _WIDE / 2, _TOP + _HIGH + 38, "modules", "middle"))
    return _svg(_LEFT + _WIDE + 270, _TOP + _HIGH + 50, one["title"], parts)


def _ends(cell: Mapping[str, Any]) -> list[float]:
    """The value, and its interval where there is one."""
    middle = cell["measured"]
    return [middle, *((middle, middle) if cell["low"] is None else (cell["low"], cell["high"]))]


def _log_axis(among: Sequence[float], begin: float, length: float) -> Callable[[float], float]:
    """From a value to its place: whole powers of ten at both ends."""
    low, high = _floor(min(among)), -_floor(1 / max(among))
    return lambda value: begin + length * (log10(value) - low) / max(high - low, 1)


def _floor(value: float) -> int:
    return floor(log10(value) + 1e-9)


def _grid(x_of: Mapping[str, float]) -> Iterator[str]:
    for share in range(0, 101, 20):
        yield _bar(_LEFT, _y(share), _LEFT + _WIDE, _y(share), "#e0e0e0")
        yield _text(_LEFT - 8, _y(share) + 4, str(share), "end")
    for at, x in x_of.items():
        yield _text(x, _TOP + _HIGH + 18, at, "middle")


def _y(share: float) -> float:
    return _TOP + _HIGH * (1 - share / 100)


def _bar(x1: float, y1: float, x2: float, y2: float, colour: str) -> str:
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}"/>'


def _diamond(x: float, y: float, colour: str) -> str:
    corners = ((x, y - 6), (x + 6, y), (x, y + 6), (x - 6, y))
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
    return f'<polygon points="{points}" fill="#fff" fill-opacity="0.6" stroke="{colour}"/>'


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'


def _svg(width: float, height: float, title: str, parts: Iterable[str] | Sequence[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}" font-family="sans-serif" font-size="12" role="img">'
        f"<title>{escape(title)}</title>"
        '<rect width="100%" height="100%" fill="#fff"/>' + "".join(parts) + "</svg>"
    )
