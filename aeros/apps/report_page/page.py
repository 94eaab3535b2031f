"""The report page: one HTML file without external resources.

Texts from modules, planners and sites are escaped here and nowhere else.  The page's content security policy
allows a single script by its digest (`scripts`).
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from html import escape
from itertools import groupby
from math import inf
from typing import Any

import aeros
from aeros.apps.drawings.drawing import svg
from aeros.apps.report_page.cell_sketch import cell_sketch, paths_of
from aeros.apps.report_page.film_element import FilmFile, film_element
from aeros.apps.report_page.film_link import FilmLink
from aeros.apps.report_page.plots import COLOURS, Mark, collect_marks, plot, timeline
from aeros.apps.report_page.rows import DecisionRow, group_decisions
from aeros.apps.report_page.run_data import RunData, shortened
from aeros.apps.report_page.run_diagrams import plan_diagram, run_diagram
from aeros.apps.report_page.scripts import FILM, FILTER
from aeros.apps.report_page.series import Series, build_series
from aeros.spec.diagnostics.codes import CODES
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.model.site import Site

_STYLE = """\
:root{color-scheme:light dark;--ink:#222;--paper:#fff;--line:#ccc;--quiet:#595959;--ground:#f5f5f5;
--bad:#a63a00;--good:#005b8f;--link:#005b8f}
@media(prefers-color-scheme:dark){:root{--ink:#e4e6e8;--paper:#17191c;--line:#4a4f55;--quiet:#a5abb1;
--ground:#22262a;--bad:#ff9b5e;--good:#6cc0f5;--link:#6cc0f5}}
body{font:14px/1.45 sans-serif;margin:2em auto;max-width:1120px;padding:0 1em;overflow-wrap:break-word;
color:var(--ink);background:var(--paper)}
h1{font-size:1.5em;overflow-wrap:anywhere}
h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid var(--line)}
nav a{display:inline-block;min-height:24px;margin-right:1em}
a,span[role=button]{color:var(--link);text-decoration:underline}
video,.film{max-width:100%}.scroll,.paper{overflow-x:auto}
table{border-collapse:collapse}
td,th{text-align:left;vertical-align:top;padding:2px 10px 2px 0}
.wide td{border-top:1px solid var(--line)}.bad{color:var(--bad);font-weight:bold}.good{color:var(--good)}
code,.n{font-family:monospace;overflow-wrap:anywhere}svg{display:block}svg text{fill:var(--ink)}
.ground{fill:var(--ground)}.grid{stroke:var(--line)}.axis{stroke:var(--ink)}.line{stroke:var(--good)}
.zone{fill:var(--ink);fill-opacity:.04;stroke:var(--quiet)}
.paper{background:#fff;width:fit-content;max-width:100%}.paper svg text{fill:#111}
.key{display:inline-block;width:1em;height:.8em;margin:0 .3em 0 1em}.quiet{color:var(--quiet)}
form label{margin-right:1em}[hidden]{display:none}[role=button]{cursor:pointer}
@media(max-width:700px){body{margin:1em auto}td,th{padding-right:6px}}
"""

_MAX_PLANS = 60
_MAX_MARKS = 300
_MAX_TEXT_CHARS = 1000


def page_of(
    run: RunData, name: str, sites: Mapping[str, Site], signed: str, film: FilmFile | None = None
) -> str:
    """Render the page about a run.

    Args:
        run: Data of the run.
        name: Title of the run, such as the name of its folder.
        sites: Sites of the run that are available, by digest; bounds are drawn only for these.
        signed: Result of the check of signatures, as text.
        film: The film of the run; None if there is none.

    Returns:
        An HTML document.
    """
    link = FilmLink(None if film is None else film.span)
    marks = collect_marks(run)
    series = build_series(run, sites)
    sections = [
        ("Summary", _summary(run, signed)),
        *([] if film is None else [("Film", [film_element(film)])]),
        ("Cell from above", _cell(run, sites)),
        ("Task graph", _plans(run)),
        ("Skill sequence", [_on_paper(svg(run_diagram(run)))]),
        ("Timeline", [timeline(run, marks, link), _legend(), *_marks(marks, link)]),
        ("Stops", _stops(run, link)),
        ("Distances, speeds and forces against their bounds", _plots(run, series, sites, marks)),
        ("Decisions", _decisions(run, link)),
        ("Configuration", _configuration(run)),
    ]
    script = FILTER if link.span is None else FILTER + FILM
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    if film is not None:
        policy += "; media-src data:; img-src data:"
    title = _text(f"run {name}", 200)
    headings = [(f"part-{number}", *section) for number, section in enumerate(sections, 1)]
    contents = "".join(f'<a href="#{part}">{heading}</a>' for part, heading, _ in headings)
    return "\n".join(
        [
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            f"<title>{title}</title><style>{_STYLE}</style></head><body>",
            f'<header><h1>{_headline(run)}</h1><p class="quiet">{title}</p>',
            f'<nav aria-label="Parts of this page">{contents}</nav></header><main>',
            *(
                f'<section aria-labelledby="{part}"><h2 id="{part}">{heading}</h2>\n'
                + "\n".join(parts)
                + "</section>"
                for part, heading, parts in headings
            ),
            f'</main><footer class="quiet">Made by aeros {aeros.__version__} from the files of the run.',
            f"</footer><script>{script}</script></body></html>",
            "",
        ]
    )


def _headline(left: RunData) -> str:
    """Say if the chain is broken, what was asked for, how that ended and when, and count denials."""
    ended = _end_of_task(left)
    selected = (details for kind, details in reversed(left.notes) if kind == "task-selected")
    asked = next((_text(details.get("instruction")) for details in selected), "no task")
    counts = left.chain.decisions
    broken = "" if left.chain.is_sound else '<span class="bad">audit chain NOT SOUND</span> · '
    return f"{broken}{asked}: {_ended(ended, left)} · {left.ends_at:.0f} s · {counts.denied} denied"


def _on_paper(diagram: str) -> str:
    """Put a diagram with colours of its own on white, whatever the colours of the page."""
    return f'<div class="paper" tabindex="0">{diagram}</div>'


def _text(value: object, max_chars: int = _MAX_TEXT_CHARS) -> str:
    """Escape a value as text, shortened to `max_chars` characters."""
    return escape(shortened(value if isinstance(value, str) else json.dumps(value, default=str), max_chars))


def _table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), kind: str = "") -> str:
    """Build a table from cells that are HTML already."""
    top = (
        "<thead><tr>" + "".join(f'<th scope="col">{one}</th>' for one in head) + "</tr></thead>"
        if head
        else ""
    )
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll" tabindex="0"><table class="{kind}">{top}<tbody>{body}</tbody></table></div>'


# Summary and sketch


def _cell(left: RunData, sites: Mapping[str, Site]) -> Iterator[str]:
    used = [sites[one.site] for one in left.decisions if one.site is not None and one.site in sites]
    site = next(iter(used or sites.values()), None)
    if site is None:
        yield "<p>Without the site of the run, its cell is not drawn.</p>"
    else:
        drawn = cell_sketch(site, paths_of(left, site))
        yield drawn or "<p>The site has no volumes, and no places were recorded.</p>"


def _summary(left: RunData, signed: str) -> Iterator[str]:
    counts = left.chain.decisions
    sound = f'<span class="good">sound</span>, {left.chain.records} records'
    if not left.chain.is_sound:
        sound = f'<span class="bad">NOT SOUND: {_text(left.chain.reason)}</span>; the rest is not shown'
    ended = _end_of_task(left)
    rows = [
        ("instruction", _noted_details(left, "task-selected", "instruction")),
        ("task", _noted_details(left, "task-selected", "task")),
        ("ended", _ended(ended, left)),
        ("measured", _text(ended.get("measured")) if ended is not None else ""),
        ("decisions", f"{counts.allowed} allowed, {counts.attenuated} attenuated, {counts.denied} denied"),
        ("steps", f"{len(left.runs)} run, {sum(run.failed is True for run in left.runs)} failed"),
        ("time", f"{left.ends_at:.2f} s on the plant's clock"),
        ("audit chain", sound),
        ("signatures", _text(signed)),
    ]
    rows += [("trouble", f'<span class="bad">{_text(one)}</span>') for one in left.problems]
    yield _table(rows)


def _noted_details(left: RunData, kind: str, name: str) -> str:
    return next((_text(details.get(name)) for one, details in left.notes if one == kind), "")


def _end_of_task(left: RunData) -> Mapping[str, Any] | None:
    """Return how the last task that was selected has ended; None if that is not recorded."""
    kinds = ("task-selected", "run-ended")
    kind, details = next((one for one in reversed(left.notes) if one[0] in kinds), ("", {}))
    return details if kind == "run-ended" else None


def _ended(details: Mapping[str, Any] | None, run: RunData) -> str:
    if run.is_under_way and details is None:
        return "under way"
    if details is None:
        return '<span class="bad">no end is recorded</span>'
    if details.get("reached") is True:
        return '<span class="good">goal reached</span>'
    if details.get("skipped") is True:
        return "skipped, as its condition does not hold"
    return f'<span class="bad">goal not reached</span>: {_text(details.get("reason"))}'


def _plans(left: RunData) -> Iterator[str]:
    """Draw the latest plan and list all; consecutive equal plans are listed once."""
    latest = plan_diagram(left)
    yield "<p>The trace has no plan.</p>" if latest is None else _on_paper(svg(latest))
    plans = [(one.time, one.details.get("steps")) for one in left.events if one.kind == "plan-accepted"]
    folded = [list(group) for _, group in groupby(plans, key=lambda plan: json.dumps(plan[1]))]
    items = []
    for group in folded[:_MAX_PLANS]:
        steps = group[0][1] if type(group[0][1]) is list else [group[0][1]]
        again = f" and {len(group) - 1} times again until {group[-1][0]:.2f} s" if len(group) > 1 else ""
        items.append(f"<li>at {group[0][0]:.2f} s{again}: " + " → ".join(map(_text, steps)) + "</li>")
    if items:
        more = f"<p>… and {len(folded) - _MAX_PLANS} more</p>" if len(folded) > _MAX_PLANS else ""
        title = counted(len(plans), "plan")
        yield f"<details><summary>{title}</summary><ol>{''.join(items)}</ol>{more}</details>"


# Timeline


def _legend() -> str:
    keys = (
        f'<svg class="key" viewBox="0 0 1 1" aria-hidden="true"><rect width="1" height="1" fill="{colour}"/>'
        f"</svg>{sort}"
        for sort, colour in COLOURS.items()
    )
    return f"<p>{''.join(keys)}</p>"


def _marks(marks: Sequence[Mark], link: FilmLink) -> Iterator[str]:
    if marks:
        rows = [
            (link.text(one.time, f"{one.time:.2f} s"), one.category, _text(one.text))
            for one in marks[:_MAX_MARKS]
        ]
        more = f" of which the first {_MAX_MARKS} are listed" if len(marks) > _MAX_MARKS else ""
        yield f"<details open><summary>{counted(len(marks), 'mark')}{more}</summary>{_table(rows)}</details>"


def _stops(left: RunData, link: FilmLink) -> Iterator[str]:
    if not left.stops:
        yield "<p>The robot was never stopped.</p>"
        return
    shown = left.stops[:_MAX_MARKS]
    rows = [(link.text(time, f"{time:.2f} s"), _text(text)) for time, text in shown]
    yield _table(rows, ("began", "how it went"), "wide")
    if len(left.stops) > _MAX_MARKS:
        yield f"<p>… and {len(left.stops) - _MAX_MARKS} more</p>"


# Plots


def _plots(left: RunData, series: Series, sites: Mapping[str, Site], marks: Sequence[Mark]) -> Iterator[str]:
    missing = {one.site for one in left.decisions} - sites.keys()
    if missing:
        digests = ", ".join(_text(one) for one in sorted(map(str, missing)))
        yield f'<p class="bad">No bounds are drawn under sites that are not available: {digests}</p>'
    if not left.samples:
        yield "<p>The run has no samples; values are only those of decisions.</p>"
    else:
        yield "<p>Values are samples, ten a second, and those of decisions.</p>"
    if series.sample_step > 1:
        yield f"<p>Bounds are evaluated at each {series.sample_step}th sample, and at each decision.</p>"
    shown = [one for one in series.quantities.values() if one.is_single and (one.upper or one.lower)]
    tightness = _relative_margins(series)
    shown.sort(key=lambda one: (tightness.get(one.name, inf), one.is_requested, one.name))
    stops = [one for one in marks if one.category in ("stopped", "fault")]
    # Nothing that broke a rule is folded.
    flat = [one for one in shown if one.is_flat and tightness.get(one.name, inf) >= 0.0]
    yield from (plot(one, stops, left.ends_at) for one in shown if one not in flat)
    if flat:
        plots = "".join(plot(one, stops, left.ends_at) for one in flat)
        names = ", ".join(_text(one.name) for one in flat)
        yield f"<details><summary>without a change: {names}</summary>{plots}</details>"
    nearest = sorted(
        series.closest_approaches.values(), key=lambda one: (one.margin / (abs(one.bound) or 1), one.rule)
    )
    if nearest:
        yield "<p>Smallest margin of each rule at the times above, smallest first:</p>"
        yield _table(
            (
                (
                    _text(one.rule),
                    f"<code>{_text(one.quantity)}</code>",
                    f"{one.measured:.4g} {_text(one.unit)}",
                    f"{'at most' if one.is_upper else 'at least'} {one.bound:.4g} {_text(one.unit)}",
                    f'<span class="{"bad" if one.margin < 0 else "n"}">{one.margin:.3g}</span>',
                    f"{one.time:.2f} s",
                )
                for one in nearest
            ),
            ("rule", "quantity", "was", "allowed", "margin", "at"),
            "wide",
        )


def _relative_margins(series: Series) -> dict[str, float]:
    """Return the smallest margin of each quantity, as a share of the bound."""
    found: dict[str, float] = {}
    for (_, name), one in series.closest_approaches.items():
        found[name] = min(found.get(name, inf), one.margin / (abs(one.bound) or 1.0))
    return found


# Decisions


def _decisions(left: RunData, link: FilmLink) -> Iterator[str]:
    rows, left_out = group_decisions(left.decisions)
    skills = sorted({row.first.skill for row in rows})
    options = "".join(f'<option value="{_text(one)}">{_text(one)}</option>' for one in skills)
    verdicts = "".join(
        f'<label><input type="checkbox" value="{one}" checked> {one}</label>'
        for one in ("ALLOW", "ATTENUATE", "DENY")
    )
    yield (
        f'<form id="filter" hidden>{verdicts}<label>skill <select name="skill"><option value="">all</option>'
        f'{options}</select></label><label>with the words <input name="words"></label>'
        '<span id="shown"></span></form>'
    )
    yield "<p>Consecutive equal decisions of a skill share a row.</p>"
    if left_out:
        yield f"<p>{left_out} more are left out, plain ALLOWs first: `aeros audit show` has them all.</p>"
    head = ("records", "time", "verdict", "skill", "action", "why")
    heads = "".join(f'<th scope="col">{one}</th>' for one in head)
    yield '<div class="scroll" tabindex="0"><table id="decisions" class="wide">'
    yield f"<thead><tr>{heads}</tr></thead><tbody>"
    yield from (_row(row, link) for row in rows)
    yield "</tbody></table></div>"


def _row(row: DecisionRow, link: FilmLink) -> str:
    one, last = row.first, row.last
    records = f"{one.sequence}" + (f"–{last.sequence}" if row.count > 1 else "")
    times = f"{one.time:.2f}" + (f"–{last.time:.2f} s" if row.count > 1 else " s")
    again = f"{row.count} × " if row.count > 1 else ""
    cells = (
        records,
        link.text(one.time, times),
        f"{again}{_text(one.decision)}",
        _text(one.skill),
        f"<code>{_text(one.kind)}({_arguments(one.requested)})</code>" + (" …" if row.count > 1 else ""),
        _reasons_html(row),
    )
    data = f'data-verdict="{_text(one.decision)}" data-skill="{_text(one.skill)}" data-count="{row.count}"'
    return f"<tr {data}>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _arguments(given: Mapping[str, Any]) -> str:
    return _text(", ".join(f"{name}={_rounded(value)}" for name, value in given.items()), 300)


def _rounded(value: Any) -> str:
    if type(value) is float:
        return f"{value:.4g}"
    if type(value) is list:
        return "[" + ", ".join(map(_rounded, value)) + "]"
    return json.dumps(value)


def _reasons_html(row: DecisionRow) -> str:
    one = row.first
    lines = []
    for code, rule, text in one.reasons:
        summary = CODES[code].summary if code in CODES else "not a code of this version"
        lines.append(
            f'<b title="{_text(summary)}">{_text(code)}</b> <code>{_text(rule)}</code>: {_text(text)}'
        )
    if one.decision == "ATTENUATE":
        lines.append(f"reduced to <code>{_arguments(one.decided)}</code>")
    return "<br>".join(lines)


# Configuration


def _configuration(left: RunData) -> Iterator[str]:
    for number, session in enumerate(left.sessions):
        site = session.get("site")
        modules = session.get("modules")
        rows = [
            ("configuration", f"<code>{_text(session.get('configuration'))}</code>"),
            ("site", _digest_rows(site if type(site) is dict else {}, ("id", "digest"))),
        ]
        for name, module in (modules if type(modules) is dict else {}).items():
            digests = _digest_rows(module if type(module) is dict else {}, ("version", "manifest", "code"))
            rows.append((f"module {_text(name)}", digests))
        yield "<p>As the run began:</p>" if number == 0 else "<p>Then:</p>"
        yield _table(rows)
    written = datetime.now().astimezone().isoformat(" ", "seconds")
    yield f"<p>head of the chain <code>{_text(left.chain.head)}</code>; read {written}</p>"


def _digest_rows(details: Mapping[str, Any], names: Sequence[str]) -> str:
    return "<br>".join(f"{name} <code>{_text(details.get(name))}</code>" for name in names)
