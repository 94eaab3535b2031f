"""Results as a document in Markdown, block by block: headings, paragraphs, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from aeros.experiments.report.figures import figures_of
from aeros.experiments.report.markdown import Block, figure_block, heading, mark, table

Results = Mapping[str, Any]

_REFERENCE_VALUES: Final = {"paper": "paper", "independent": "if independent", "exact": "exact"}
"""Titles of reference values next to the measured one, in this order."""

_TIMING_COLUMNS: Final = {
    "alone_s": ("processor time by itself, ms a trial", 1000),
    "processor_s": ("processor time, ms a trial", 1000),
    "swap_s": ("loading the module, proved and compiled before, ms a trial", 1000),
    "reaction_s": ("from hazard to stop, real time, ms a trial", 1000),
}
"""Timings, which differ between runs: title, and factor from seconds to its unit."""


def document(results: Results, figures: str, top_level: int = 1) -> Iterator[Block]:
    """Describe the results, in order.

    Args:
        results: of `compute_results`.
        figures: folder of the figures, as the text names it.
        top_level: level of the first heading, from 1.

    Yields:
        Blocks of the document.
    """
    yield heading(top_level, title_of(results))
    first, last = results["seeds"]
    yield Block(
        f"{results['trials']} trials of each condition, seeds {first} to {last}, the same for all: "
        "trials of one seed are alike but for what their condition changes. Intervals are of 95 %, Wilson's "
        "for shares. *Exact* is computed of the very manifests that ran, with the chances of the condition; "
        "nothing of it is sampled. Of what is no outcome of a task (what is blocked, violated or lost) it is "
        "what AEROS claims. ▲ marks a value outside the interval of what was measured; of intervals of 95 % "
        "one in twenty misses."
    )
    yield from _workload(results["work"])
    yield Block(_agreement(results))
    yield _environment(results)
    for one in results["experiments"]:
        yield from _experiment(one, figures, top_level)


def title_of(results: Results) -> str:
    """Name the experiments of the results, and their plant.

    Args:
        results: of `compute_results`.

    Returns:
        The title.
    """
    numbers = sorted(one["number"] for one in results["experiments"])
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    named = ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)
    return f"Experiment{'s' if len(numbers) > 1 else ''} {named} on the {results['plant']} plant"


def _workload(work: Mapping[str, Any]) -> Iterator[Block]:
    """Describe the processor time of all trials, and how much of it they shared."""
    took = f"{work['trials']:,} trials took {work['processor_s'] / 3600:.2f} hours of processor"
    if work["sharing"]:
        took += (
            f"; of the {work['sharing']:,} of one task, {work['plants']:,} needed a plant of their own: one "
            "does the same whenever the same is asked of it and chance does the same, so trials share what "
            "one did"
        )
    yield Block(f"{took}.")


def _agreement(results: Results) -> str:
    """Count the values that agree with the exact ones, once for each condition."""
    cells = {
        (row["digest"], name): cell
        for one in results["experiments"]
        for row in one["rows"]
        for name, cell in row["cells"].items()
        if cell["exact"] is not None and cell["low"] is not None
    }
    shares = [cell for cell in cells.values() if "hits" in cell]
    means = [cell for cell in cells.values() if "hits" not in cell]
    texts = [
        f"{sum('exact' in cell['misses'] for cell in of)} of {len(of)} {what}"
        for of, what in ((shares, "shares"), (means, "means"))
    ]
    return f"The exact value is outside the interval of {texts[0]} and {texts[1]}."


def _environment(results: Results) -> Block:
    of = results["environment"]
    rows = [
        ("commit", of["commit"] or "not known"),
        ("premises", results["premises"]),
        ("Python", of["python"]),
        ("platform", f"{of['platform']}, {of['processors']} processors"),
        ("packages", ", ".join(f"{name} {release}" for name, release in of["packages"].items())),
    ]
    return table(("made with", ""), rows)


def _experiment(one: Mapping[str, Any], figures: str, top_level: int) -> Iterator[Block]:
    yield heading(top_level + 1, f"{one['number']} {one['title']}")
    if one["label"] is not None:
        yield Block(f"In the paper: {one['label']}.")
    if one["note"]:
        yield Block(one["note"])
    if one["means"]:
        yield _means(one)
    many = len(one["rows"]) > 20
    yield table(*_rows(one), f"all {len(one['rows'])} conditions" if many else "")
    for why in dict.fromkeys(text for row in (*one["rows"], *one["means"]) for text in row["why"]):
        yield Block(why)
    yield from _sampling_note(one)
    yield from _unexplained(one)
    yield from _not_predicted(one)
    for row in one["rows"]:
        if row["raised"]:
            yield Block(f"In {row['id']} an architecture raised: {', '.join(row['raised'])}.")
    for test in one["tests"]:
        yield from _test(test)
    if any(test["by_task"] for test in one["tests"]):
        yield Block(_ABOUT_TESTS)
    for figure in figures_of(one):
        yield figure_block(figure, figures)
    if one["overhead"]:
        yield _overhead(one["overhead"])
    yield _timings(one["timings"])
    yield Block("Again: " + f"`{one['rows'][0]['rerun']}`, and so with any other condition's name.")


def _unexplained(one: Mapping[str, Any]) -> Iterator[Block]:
    """List what is marked without a known reason."""
    titles = {name: metric["title"] for name, metric in one["metrics"].items()}
    texts = [
        f"{row['id']} ({titles.get(name, name)}: {_REFERENCE_VALUES[which]})".replace("*", "\\*")
        for row in (*one["rows"], *one["means"])
        for name, which in (mark.split(": ") for mark in row["unexplained"])
    ]
    if texts:
        yield Block("Marked, and not explained: " + ", ".join(texts) + ".")


def _not_predicted(one: Mapping[str, Any]) -> Iterator[Block]:
    """List rows without an exact success, and the reason where there is one."""
    for row in one["rows"]:
        if row["not_predicted"]:
            yield Block(f"Nothing is predicted of {row['id']}: {row['not_predicted']}.")
    silent = [
        row["id"]
        for row in one["rows"]
        if not row["not_predicted"] and "success" in row["cells"] and row["cells"]["success"]["exact"] is None
    ]
    if silent:
        yield Block(f"Whether these reach their goal is not predicted: {', '.join(silent)}.")


def _sampling_note(one: Mapping[str, Any]) -> Iterator[Block]:
    """Describe how many of the marked values chance in the draws explains."""
    rows, explained = [], 0
    for row in one["rows"]:
        drawn = row["drawn"] or {"exact": {}}
        for name, value in drawn["exact"].items():
            misses = ["exact", *(["drawn"] if name in drawn["misses"] else [])]
            explained += name not in drawn["misses"]
            cell = {**row["cells"][name], "drawn": value, "misses": misses}
            title = one["metrics"][name]["title"]
            rows.append(
                (row["id"], f"{drawn['share']:.1f}", title, *_reference_cells(cell, ("exact", "drawn")))
            )
    if not rows:
        return
    yield Block(
        f"{len(rows)} exact values of other things than failed attempts are marked. Trials of a seed draw "
        "the same numbers at every rate and in every architecture, so where few attempts fail in one "
        "condition, few fail in many. At the share of attempts that did fail, what is exact is inside the "
        f"interval of {explained} of them: given how many failed, those are as expected. Whether as many "
        "failed as should have is another question, which the column of failed attempts answers with marks "
        "of its own."
    )
    head = ("condition", "attempts that failed, %", "marked", "exact", "exact at that share", "measured")
    yield table(head, rows, "what is marked, and what chance in the draws explains of it")


def _overhead(overhead: Sequence[Mapping[str, Any]]) -> Block:
    """Tabulate the time of a trial without physics, with every decision and record of the runtime."""
    head = ("a trial without physics", "paper, ms", "measured, ms of processor")
    rows = [
        (one["title"], "" if one["paper"] is None else f"{one['paper']:g}", f"{one['measured']:.1f}")
        for one in overhead
    ]
    return table(head, rows)


def _timings(timings: Mapping[str, Mapping[str, float]]) -> Block:
    """Tabulate times, which differ between runs; trials that share a trial have its times."""
    names = [name for name in _TIMING_COLUMNS if any(name in one for one in timings.values())]
    rows = [
        (id_, *(f"{_TIMING_COLUMNS[name][1] * one[name]:.2f}" if name in one else "" for name in names))
        for id_, one in timings.items()
    ]
    return table(("condition", *(_TIMING_COLUMNS[name][0] for name in names)), rows, "how long it took")


def _means(one: Mapping[str, Any]) -> Block:
    rows = []
    others = _reference_columns([mean["cell"] for mean in one["means"]], always=("paper", "exact"))
    for mean in one["means"]:
        labels = [mean["title"], *([mean["at"]] if mean["along"] else [])]
        rows.append((*labels, *_reference_cells(mean["cell"], others)))
    varied = one["means"][0]["along"]
    head = ["mean over tasks", *([varied] if varied else [])]
    head += [f"{_REFERENCE_VALUES[name]}, %" for name in others]
    return table([*head, "measured, %"], rows)


def _reference_columns(cells: Sequence[Mapping[str, Any]], always: Sequence[str] = ()) -> list[str]:
    """List the columns that stand next to the measured value."""
    return [
        name for name in _REFERENCE_VALUES if name in always or any(cell[name] is not None for cell in cells)
    ]


def _rows(one: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Build head and rows of the table of all conditions."""
    there = {
        name: _reference_columns(cells)
        for name in one["metrics"]
        if (cells := [row["cells"][name] for row in one["rows"] if name in row["cells"]])
    }
    labels = max(len(row["labels"]) for row in one["rows"])
    head = ["condition", *[""] * labels]
    for name, others in there.items():
        metric = one["metrics"][name]
        unit = ", %" if metric["share"] else ""
        texts = (*(_REFERENCE_VALUES[other] for other in others), "measured")
        head += [f"{metric['title']}{unit}: {other}" for other in texts]
    has_messages = any(row.get("told") for row in one["rows"])
    head += ["what was said"] if has_messages else []
    rows = []
    for row in one["rows"]:
        cells = [row["id"], *row["labels"], *[""] * (labels - len(row["labels"]))]
        for name, others in there.items():
            cell = row["cells"].get(name)
            cells += [""] * (len(others) + 1) if cell is None else _reference_cells(cell, others)
        cells += [", ".join(row.get("told", ()))] if has_messages else []
        rows.append(cells)
    return head, rows


def _reference_cells(cell: Mapping[str, Any], others: Sequence[str]) -> list[str]:
    """Format the reference values, each marked where it is outside the interval, and the measured value."""
    digits = 1 if "hits" in cell else 2
    found = [
        mark("" if cell[name] is None else _number(cell[name], digits), name in cell["misses"])
        for name in others
    ]
    shown = _number(cell["measured"], digits)
    if cell["low"] is not None:
        shown += f" [{_number(cell['low'], digits)}, {_number(cell['high'], digits)}]"
    return [*found, shown]


def _number(value: float, digits: int) -> str:
    """Format a number; only an exact 100 is shown as 100, not a value that rounds to it."""
    if abs(value - 100) < 1e-9:
        return "100"
    is_near = 100 - 0.5 * 10**-digits <= value < 100
    return f"> {100 - 10**-digits:.{digits}f}" if is_near else f"{value:.{digits}f}"


def _test(test: Mapping[str, Any]) -> Iterator[Block]:
    rows = [
        (
            " ".join(filter(None, (one["task"], one["at"]))),
            f"{_number(_difference(one), 1)} [{', '.join(_number(end, 1) for end in one['difference'])}]",
            _number(one["detectable"], 1),
            one["paper"] or "",
            f"{one['one_sided']:.2g}",
            *(f"{one[name]:.2g}" for name in ("fisher", "fisher_holm", "mcnemar", "mcnemar_holm")),
        )
        for one in test["by_task"]
    ]
    if rows:
        head = (
            f"{test['first']} against {test['second']}",
            "difference, points",
            "seen with 80 %, from",
            "p, paper",
            "p, Fisher's, one side",
            "p, Fisher's",
            "Holm",
            "p, McNemar's",
            "Holm",
        )
        yield table(head, rows)


_ABOUT_TESTS: Final = (
    "The paper's values are of Fisher's exact test with one side: 95 against 100 of 100 have 0.030, "
    "and with both 0.059. As both ran the same seeds, McNemar's exact test, which compares seed by "
    "seed, is the one that fits. *Holm*: the value before it, corrected for the number of tests of this "
    "experiment. *Seen with 80 %, from*: so many trials of each show a difference of that size in four of "
    "five cases by Fisher's test without correction; of smaller ones they say little."
)


def _difference(one: Mapping[str, Any]) -> float:
    """Return the difference of two shares, in points of percent."""
    first, second = (float(hits / trials) for hits, trials in one["counts"])
    return 100.0 * (first - second)
