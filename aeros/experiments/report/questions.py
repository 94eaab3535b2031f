"""The page of results: a few questions, each with two sentences and one table of what was measured."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from aeros.experiments.catalogue import read_data
from aeros.experiments.report.markdown import Block, heading, table
from aeros.spec.diagnostics.errors import InternalError

PLACEHOLDER: Final = re.compile(r"\{([^{}:]+):([a-z_]+)(?::(exact|paper))?\}")
"""A value in a text: row, metric, and which value if not the measured one."""

Kept = Mapping[str, Mapping[str, Any]]
"""Kept results by the name of their folder."""


def question_blocks(kept: Kept) -> Iterator[Block]:
    """Answer the questions whose results are kept.

    Args:
        kept: results by folder.

    Yields:
        For each question a heading, its text with the values filled in, and its table.

    Raises:
        InternalError: a question names a row or metric that its results do not have.
    """
    for one in read_data("questions.toml")["question"]:
        if one["results"] not in kept:
            continue
        results = kept[one["results"]]
        rows = _cells_by_row(results)
        yield heading(2, one["title"])
        yield Block(_filled(one["text"], rows))
        yield _table(one, rows, results)


def _cells_by_row(results: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the cells of each row, and of each mean over tasks, by metric."""
    found: dict[str, Mapping[str, Any]] = {}
    for experiment in results["experiments"]:
        titles = {name: metric["title"] for name, metric in experiment["metrics"].items()}
        rows = [(row["id"], row["cells"]) for row in experiment["rows"]]
        rows += [(mean["id"], {"success": mean["cell"]}) for mean in experiment["means"]]
        for id_, cells in rows:
            found[id_] = {name: {**cell, "title": titles[name]} for name, cell in cells.items()}
    return found


def _filled(text: str, rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a text with the values that its placeholders name."""

    def value(found: re.Match[str]) -> str:
        number = rows.get(found[1], {}).get(found[2], {}).get(found[3] or "measured")
        if number is None:
            raise InternalError(f"`{found[0]}`: there is no such value among the kept results")
        return _number(number)

    return PLACEHOLDER.sub(value, text)


def _table(
    one: Mapping[str, Any], rows: Mapping[str, Mapping[str, Any]], results: Mapping[str, Any]
) -> Block:
    """Make the table of a question: for each metric the values that any of its rows has.

    Raises:
        InternalError: the results do not have one of its rows.
    """
    asked = {label: rows.get(id_) for label, id_ in one["rows"].items()}
    missing = [one["rows"][label] for label, cells in asked.items() if cells is None]
    if missing:
        raise InternalError(f"{one['title']}: the kept results have no row `{missing[0]}`")
    listed = {label: cells or {} for label, cells in asked.items()}
    shown = one.get("shown", ("paper", "exact", "measured"))
    columns = [
        (name, which)
        for name in one["metrics"]
        for which in shown
        if any(name in cells and cells[name][which] is not None for cells in listed.values())
    ]
    head = [f"{results['plant']}, {results['trials']} trials each"]
    head += [_title(name, which, listed.values()) for name, which in columns]
    body = [
        [label, *(_cell(cells.get(name), which) for name, which in columns)]
        for label, cells in listed.items()
    ]
    return table(head, body)


def _title(name: str, which: str, rows: Iterable[Mapping[str, Any]]) -> str:
    cell = next(cells[name] for cells in rows if name in cells)
    return f"{cell['title']}{', %' if 'hits' in cell else ''}: {which}"


def _cell(cell: Mapping[str, Any] | None, which: str) -> str:
    if cell is None or cell[which] is None:
        return ""
    text = _number(cell[which])
    if which != "measured" or cell["low"] is None:
        return text
    return f"{text} [{_number(cell['low'])}, {_number(cell['high'])}]"


def _number(value: float) -> str:
    """Format a number with one digit; only an exact 100 is shown as 100."""
    if abs(value - 100) < 1e-9:
        return "100"
    return "> 99.9" if 99.95 <= value < 100 else f"{value:.1f}"


ENTERED: Final = 16
"""Number of the experiment that ranks entries: all have the same budgets."""


def entries_table(kept: Kept) -> Block:
    """Rank all architectures that took part in the experiment of equal budgets, baselines included.

    Args:
        kept: results by folder.

    Returns:
        A table of success on average over the tasks, the best on average over the budgets first.
    """
    means = [
        (folder, results, mean)
        for folder, results in kept.items()
        for one in results["experiments"]
        if one["number"] == ENTERED
        for mean in one["means"]
    ]
    budgets = list(dict.fromkeys(mean["at"] for _, _, mean in means))
    entries: dict[tuple[str, str, str], dict[str, Mapping[str, Any]]] = {}
    for folder, results, mean in means:
        entries.setdefault((mean["title"], folder, results["plant"]), {})[mean["at"]] = mean["cell"]
    ranked = sorted(entries.items(), key=lambda entry: (-_mean_success(entry[1]), entry[0]))
    head = ("entry", "results", "plant", *(f"success, %: {budget}" for budget in budgets))
    rows = [
        (title, folder, plant, *(_cell(cells.get(budget), "measured") for budget in budgets))
        for (title, folder, plant), cells in ranked
    ]
    return table(head, rows)


def _mean_success(cells: Mapping[str, Mapping[str, Any]]) -> float:
    return sum(float(cell["measured"]) for cell in cells.values()) / len(cells)
