"""SVG sketch of the cell from above: volumes of the site, paths of the robot, and where people went."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from math import floor, isfinite, log10
from typing import Any, Final, NamedTuple

from aeros.apps.report_page.run_data import RunData, shortened
from aeros.spec.expr.types import VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.site import Site

Place = tuple[float, float]

PERSON: Final = "person"

_WIDTH, _HEIGHT, _MARGIN = 900.0, 460.0, 24.0
_AROUND: Final = 0.6
"""Distance around the paths that is drawn, m."""

_STEP: Final = 0.004
"""Least distance between drawn points, as a share of the sketch's width."""

_COLOURS: Final = ("#0072b2", "#009e73", "#cc79a7")
_PERSON_COLOUR: Final = "#d55e00"


class SketchPath(NamedTuple):
    """A path over the floor.

    Attributes:
        name: name of the variable that was measured, or `PERSON` for a simulated person.
        places: x and y in W, m, in order of time.
    """

    name: str
    places: Sequence[Place]


def paths_of(run: RunData, site: Site) -> list[SketchPath]:
    """Collect the paths of a run.

    Args:
        run: data of the run.
        site: declares the measured vocabulary.

    Returns:
        The paths of the site's own places, as its robot measured them, and then those of simulated people.
    """
    found: dict[str, list[Place]] = {
        name: []
        for name, one in site.state.items()
        if "." not in name and one.variable.type == VectorType(LENGTH)
    }
    for _, state in run.samples:
        for name, places in found.items():
            pair = state.get(name)
            place = _place(pair[0]) if type(pair) is list and pair else None
            if place is not None:
                places.append(place)
    paths = [SketchPath(name, places) for name, places in found.items() if places]
    for number in range(max((len(people) for _, people in run.people), default=0)):
        walked = [people[number] for _, people in run.people if number < len(people)]
        paths.append(SketchPath(PERSON, walked))
    return paths


def cell_sketch(site: Site, paths: Sequence[SketchPath]) -> str | None:
    """Draw the cell from above, x to the right and y upwards.

    Args:
        site: its volumes are drawn.
        paths: paths to draw.

    Returns:
        An SVG element and a legend; None if there is nothing to draw.
    """
    zones = {
        name: tuple(float(corner[axis]) for corner in (box.lower, box.upper) for axis in (0, 1))
        for name, box in site.volumes.items()
    }
    corners = [place for x, y, right, top in zones.values() for place in ((x, y), (right, top))]
    places = [place for path in paths for place in path.places]
    if not places and not corners:
        return None
    # Volumes of a site may reach far beyond the cell; the rest of it would be a dot.
    near = [(x + dx, y + dy) for x, y in places for dx, dy in ((-_AROUND, -_AROUND), (_AROUND, _AROUND))]
    frame = _Frame(near or corners)
    parts = list(_zones(zones, frame))
    colours = _colours(paths)
    for path in paths:
        parts += _path(path, colours[path.name], frame)
    parts.append(_scale_bar(frame))
    legend = "".join(
        f'<svg class="key" viewBox="0 0 1 1" aria-hidden="true"><rect width="1" height="1" fill="{colour}"/>'
        f"</svg>{escape(name)}"
        for name, colour in colours.items()
    )
    title = "the cell from above"
    width, height = f"{frame.width:.0f}", f"{frame.height:.0f}"
    return (
        f'<div class="scroll" tabindex="0"><svg viewBox="0 0 {width} {height}" width="{width}"'
        f' height="{height}" role="img" aria-label="{title}" font-size="11">'
        f"<title>{title}</title>{''.join(parts)}</svg></div><p>{legend}</p>"
    )


class _Frame:
    """Map from W to the sketch, with one scale for both axes."""

    def __init__(self, places: Sequence[Place]) -> None:
        xs, ys = [x for x, _ in places], [y for _, y in places]
        self._left, self._top = min(xs), max(ys)
        wide, high = max(max(xs) - min(xs), 1e-6), max(max(ys) - min(ys), 1e-6)
        self.scale = min((_WIDTH - 2 * _MARGIN) / wide, (_HEIGHT - 2 * _MARGIN) / high)
        self.height = high * self.scale + 2 * _MARGIN
        self.width = wide * self.scale + 2 * _MARGIN

    def __call__(self, place: Place) -> Place:
        x, y = place
        return (_MARGIN + (x - self._left) * self.scale, _MARGIN + (self._top - y) * self.scale)


def _colours(paths: Sequence[SketchPath]) -> dict[str, str]:
    names = list(dict.fromkeys(path.name for path in paths))
    own = [name for name in names if name != PERSON]
    found = {name: _COLOURS[number % len(_COLOURS)] for number, name in enumerate(own)}
    return found | ({PERSON: _PERSON_COLOUR} if PERSON in names else {})


def _zones(zones: Mapping[str, Sequence[float]], frame: _Frame) -> Iterator[str]:
    """Draw the visible part of each volume, the largest first, with a name where there is room for it."""
    labels: list[tuple[float, float, float]] = []
    for name, (left, low, right, high) in sorted(
        zones.items(), key=lambda one: (one[1][0] - one[1][2]) * (one[1][3] - one[1][1])
    ):
        x, y = (max(one, 0.0) for one in frame((left, high)))
        end, foot = frame((right, low))
        end, foot = min(end, frame.width), min(foot, frame.height)
        if end <= x or foot <= y:
            continue
        shown = escape(shortened(name, 60))
        yield (
            f'<rect class="zone" x="{x:.1f}" y="{y:.1f}" width="{end - x:.1f}" height="{foot - y:.1f}">'
            f"<title>{shown}</title></rect>"
        )
        at, wide = y + 12.0, 6.5 * len(name)
        while any(abs(at - other) < 12.0 and x < stop and begin < x + wide for begin, stop, other in labels):
            at += 12.0
        if wide < end - x and at < foot:
            labels.append((x, x + wide, at))
            yield f'<text x="{x + 4:.1f}" y="{at:.1f}">{shown}</text>'


def _path(path: SketchPath, colour: str, frame: _Frame) -> Iterator[str]:
    points: list[Place] = []
    for place in map(frame, path.places):
        if not points or max(abs(a - b) for a, b in zip(place, points[-1], strict=True)) > _STEP * _WIDTH:
            points.append(place)
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dash = ' stroke-dasharray="7 4"' if path.name == PERSON else ""
    title = f"<title>{escape(path.name)}</title>"
    yield (
        f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"{dash}>{title}</polyline>'
    )
    x, y = frame(path.places[-1])
    yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}">{title}</circle>'


def _scale_bar(frame: _Frame) -> str:
    """Draw the longest bar of 1 m, or of a power of ten of it, that leaves room for its label."""
    y = frame.height - 8.0
    length = 10.0 ** floor(log10(0.9 * (frame.width - 2 * _MARGIN) / frame.scale))
    wide = length * frame.scale
    return (
        f'<path class="axis" d="M{_MARGIN} {y:.1f}h{wide:.1f}"/>'
        f'<text x="{_MARGIN + wide + 4:.1f}" y="{y + 4:.1f}">{length:g} m</text>'
    )


def _place(value: Any) -> Place | None:
    if type(value) is list and len(value) == 3 and all(type(one) in (int, float) for one in value):
        x, y = float(value[0]), float(value[1])
        return (x, y) if isfinite(x) and isfinite(y) else None
    return None
