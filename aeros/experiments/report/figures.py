"""Figures as SVG: success along what is varied, and success of each condition with its interval."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any, Final

_COLOURS: Final = ("#6d4c41", "#ef6c00", "#6a1b9a", "#1565c0", "#2e7d32", "#00838f", "#ad1457", "#455a64")

_LEFT, _TOP, _WIDE, _HIGH = 60, 20, 640, 320
_LABELS, _LINE = 470, 20
_PANEL = 110


def sweep(one: Mapping[str, Any]) -> str:
    """Mean success over tasks along what is varied: exact as lines, measured as points with intervals."""
    means = [mean for mean in one["means"] if mean["at"]]
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
