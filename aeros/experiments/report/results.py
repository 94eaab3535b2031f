"""Results of trials as data: of each row the paper's value, the exact and the measured one.

A report shows nothing but these results, so it can be made of them again anywhere.  Intervals are of 95 %.
Times are apart from the rest, which is the same for the same seeds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from math import sqrt
from statistics import fmean, median, stdev
from typing import Any, Final

from aeros.experiments.catalogue import Experiment, Metric, Row, read_data
from aeros.experiments.environment import environment
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.report.sampled_rate import exact_at_sampled_rate
from aeros.experiments.statistics import (
    detectable_difference,
    difference_interval,
    fisher_exact_test,
    holm,
    mcnemar,
    median_interval,
    wilson,
)
from aeros.experiments.trial_kinds import (
    ATTEMPT_FIELD,
    EQUIVALENT_INTERVAL,
    INDEPENDENT_PREFIX,
    TIMING_FIELDS,
    Findings,
    PredictsSeries,
    comparison_group_of,
    condition_digest,
    kind_of,
)
from aeros.spec.migrations.formats import RESULTS

SCHEMA: Final = RESULTS.schema

Trials = Mapping[tuple[str, int], Findings]
"""Finished trials by condition's digest and seed."""

COMPUTED_FIELDS: Final = {"exact": "", "independent": INDEPENDENT_PREFIX}
"""Computed values of a cell, with the prefix of their names among the expected values."""

_NORMAL_95: Final = 1.959964


def compute_results(
    experiments: Iterable[Experiment],
    trials: Trials,
    premises: TrialInputs,
    seeds: Sequence[int],
    plant: str,
    ran_with: str,
) -> dict[str, Any]:
    """Compute the results of finished trials.

    Args:
        experiments: with the rows to show.
        trials: findings by digest of the condition and seed; every row has one for every seed.
        premises: proved modules, site and compiled gate.
        seeds: of the trials, in order.
        plant: `physics` or `symbolic`.
        ran_with: options that a command to run a row again needs besides the row.

    Returns:
        The results, JSON values by name.
    """
    experiments = list(experiments)
    shown = [_experiment(one, trials, premises, seeds, ran_with) for one in experiments]
    return {
        "schema": SCHEMA,
        "plant": plant,
        "trials": len(seeds),
        "seeds": [seeds[0], seeds[-1]],
        "premises": premises.digest,
        "sources": premises.sources_digest,
        "environment": environment(),
        "work": _workload((row for one in experiments for row in one.rows), trials, premises, seeds),
        "experiments": shown,
    }


def _workload(
    rows: Iterable[Row], trials: Trials, premises: TrialInputs, seeds: Sequence[int]
) -> dict[str, Any]:
    """Count trials, trials that share, plants that these needed, and the processor time of all.

    sharing: trials of kinds that share.  A trial that stands for others of its family counts once.
    """
    of = {row.condition: _row_findings(row, trials, premises, seeds) for row in rows}
    ran = {
        (
            comparison_group_of(condition)[0] if EQUIVALENT_INTERVAL in one else condition.canonical_json,
            seed,
            tuple(one.get(EQUIVALENT_INTERVAL, ())),
        ): one
        for condition, found in of.items()
        for seed, one in zip(seeds, found, strict=True)
    }.values()
    return {
        "trials": sum(map(len, of.values())),
        "sharing": sum("live" in one for found in of.values() for one in found),
        "plants": sum(one.get("live", 0) for one in ran),
        "processor_s": sum(one.get("processor_s", 0.0) for one in ran),
    }


def _experiment(
    one: Experiment, trials: Trials, premises: TrialInputs, seeds: Sequence[int], ran_with: str
) -> dict[str, Any]:
    paper = read_data("paper.toml")
    of_rows = {row: _row_findings(row, trials, premises, seeds) for row in one.rows}
    rows = [_row(row, found, one.metrics, premises, ran_with) for row, found in of_rows.items()]
    timings = {row.id: _timings(found) for row, found in of_rows.items()}
    return {
        "number": one.number,
        "title": one.title,
        "note": one.note,
        "label": paper["source"].get(str(one.number), {}).get("label"),
        "metrics": {metric.name: {"title": metric.title, "share": metric.is_share} for metric in one.metrics},
        "rows": rows,
        "means": _means(one, rows, of_rows, premises),
        "tests": corrected_tests([_test(one, *pair, of_rows) for pair in one.compared_pairs]),
        "figure": one.figure,
        "drawn": one.plotted_metrics,
        "timings": timings,
        "overhead": _overhead(one, timings) if one.overhead else [],
    }


def _timings(found: Sequence[Findings]) -> dict[str, float]:
    """Average the times of trials; where trials share plants, the time that each would take by itself."""
    timings = {
        name: fmean(trial[name] for trial in found)
        for name in TIMING_FIELDS
        if all(name in trial for trial in found)
    }
    if "alone_s" in timings:
        del timings["processor_s"]
    return timings


def _overhead(one: Experiment, timings: Mapping[str, Mapping[str, float]]) -> list[dict[str, Any]]:
    """Average over tasks the processor time of a trial of each variant, ms."""
    paper = read_data("paper.toml")["overhead"]
    of = {
        name: [timings[row.id]["alone_s"] for row in one.rows if row.variant == name] for name in one.variants
    }
    return [
        {"title": one.variants[name], "measured": 1000 * fmean(found), "paper": paper.get(name)}
        for name, found in of.items()
        if found
    ]


def _row_findings(row: Row, trials: Trials, premises: TrialInputs, seeds: Sequence[int]) -> list[Findings]:
    digest = condition_digest(row.condition, premises.digest)
    return [trials[digest, seed] for seed in seeds]


def _row(
    row: Row, found: Sequence[Findings], metrics: Sequence[Metric], premises: TrialInputs, ran_with: str
) -> dict[str, Any]:
    expected = kind_of(row.condition.kind).expected_values(row.condition, premises)
    exact = {} if isinstance(expected, str) else expected
    paper = read_data("paper.toml")["value"].get(row.id, {})
    cells = {
        one.name: _cell(
            measure_metric(one, found),
            {name: exact.get(f"{before}{one.exact}") for name, before in COMPUTED_FIELDS.items()},
            paper.get(one.name),
        )
        for one in metrics
        if _is_measured(one, found)
    }
    drawn = _sampled_rate_cells(row, found, metrics, cells, premises)
    why, unexplained = _explanation(row.id, row.condition.plant, cells, drawn)
    return {
        "id": row.id,
        "digest": condition_digest(row.condition, premises.digest),
        "labels": row.labels,
        "variant": row.variant,
        "task": row.task,
        "rate": row.rate,
        "at": row.sweep_value,
        "along": row.sweep_axis,
        "trials": len(found),
        "cells": cells,
        "drawn": drawn,
        "not_predicted": expected if isinstance(expected, str) else None,
        "series": _series(row, found),
        "told": sorted({text for one in found for text in one.get("told", ())}),
        "raised": sorted({one["raised"] for one in found if one.get("raised")}),
        "why": why,
        "unexplained": unexplained,
        "rerun": f"aeros experiment {row.id} {ran_with}",
    }


def _sampled_rate_cells(
    row: Row,
    found: Sequence[Findings],
    metrics: Sequence[Metric],
    cells: Mapping[str, Mapping[str, Any]],
    premises: TrialInputs,
) -> dict[str, Any] | None:
    """Recompute exact values that miss their interval at the share of attempts that did fail.

    share: of attempts that failed, %; it is drawn itself, so it is not among the recomputed values.
    """
    missing = [one for one in metrics if one.name in cells and "exact" in cells[one.name]["misses"]]
    drawn = exact_at_sampled_rate(row.condition, found, premises) if missing else None
    if drawn is None:
        return None
    scaled = {
        one.name: _scale(cells[one.name]) * drawn["exact"][one.exact]
        for one in missing
        if one.exact != ATTEMPT_FIELD
    }
    return {
        "share": 100 * drawn["share"],
        "exact": scaled,
        "misses": [name for name, value in scaled.items() if _is_outside(cells[name], value)],
    }


def _series(row: Row, found: Sequence[Findings]) -> dict[str, dict[str, Any]]:
    """Average the series of trials place by place, and add what is exact there."""
    if not all("series" in one for one in found):
        return {}
    kind = kind_of(row.condition.kind)
    exact = kind.expected_series(row.condition) if isinstance(kind, PredictsSeries) else {}
    measured = {
        name: [fmean(values) for values in zip(*(one["series"][name] for one in found), strict=True)]
        for name in found[0]["series"]
    }
    return {
        name: {"measured": measured.get(name), "exact": exact.get(name)}
        for name in sorted(measured.keys() | exact)
    }


def _is_measured(metric: Metric, found: Sequence[Findings]) -> bool:
    if metric.mean:
        return any(metric.mean in one for one in found)
    names = [name for name in (metric.median, metric.maximum, metric.numerator, metric.denominator) if name]
    if not all(name in one for one in found for name in names):
        return False
    return not metric.numerator or any(one[metric.denominator] for one in found)


def measure_metric(metric: Metric, found: Sequence[Findings]) -> dict[str, Any]:
    """Measure a metric, with Wilson's interval for a share and the normal distribution's for a mean.

    Where all values are the same, a mean has an interval by the rule of three: what happened in none of n
    trials has a probability of less than 3/n.  A single value has no interval.

    Args:
        metric: the metric.
        found: findings of the trials, at least one.

    Returns:
        `measured`, `low` and `high` (None without an interval), shares in percent; of a share also `hits` and
        `of`.
    """
    if metric.is_share:
        hits = sum(one[metric.numerator or metric.denominator] for one in found)
        of = sum(one[metric.denominator] for one in found) if metric.numerator else len(found)
        return {"hits": hits, "of": of, **_share(hits, of)}
    if metric.median:
        values = [one[metric.median] for one in found]
        low, high = median_interval(values) or (None, None)
        return {"measured": median(values), "low": low, "high": high}
    if metric.maximum:
        return {"measured": max(one[metric.maximum] for one in found), "low": None, "high": None}
    # Only of trials that have it: a trial without a stop has no time to stop.
    values = [one[metric.mean] for one in found if metric.mean in one]
    middle = fmean(values)
    if len(values) == 1:
        return {"measured": middle, "low": None, "high": None}
    spread = stdev(values)
    half = _NORMAL_95 * spread / sqrt(len(values)) if spread else 3 / len(values)
    return {"measured": middle, "low": max(0.0, middle - half), "high": middle + half}


def _share(hits: int, of: int) -> dict[str, Any]:
    low, high = wilson(hits, of)
    return {"measured": 100 * hits / of, "low": 100 * low, "high": 100 * high}


def _cell(
    measured: Mapping[str, Any], computed: Mapping[str, float | None], paper: float | None
) -> dict[str, Any]:
    """Build one cell; `misses` lists the reference values outside the interval."""
    scale = _scale(measured)
    others = {name: None if value is None else scale * value for name, value in computed.items()}
    others["paper"] = paper
    return {
        **measured,
        **others,
        "misses": [name for name, value in others.items() if _is_outside(measured, value)],
    }


def _scale(measured: Mapping[str, Any]) -> int:
    """Return the factor from a computed value to the unit of the measured one: shares are in percent."""
    return 100 if "hits" in measured else 1


def _is_outside(measured: Mapping[str, Any], value: float | None) -> bool:
    if value is None or measured["low"] is None:
        return False
    # Rounding: a share of 1 has an interval that ends there.
    return not measured["low"] - 1e-9 <= value <= measured["high"] + 1e-9


def _explanation(
    id_: str, plant: str, cells: Mapping[str, Mapping[str, Any]], drawn: Mapping[str, Any] | None
) -> tuple[list[str], list[str]]:
    """Explain marked values as far as a reason is known, and list those without one.

    An explanation is of certain marks, "METRIC: WHICH", of rows of certain names, on certain plants; `by`
    limits it to values that miss by no more than this, chance in the draws aside.
    """
    drawn = drawn or {"exact": {}, "misses": []}
    as_drawn = {f"{name}: exact" for name in drawn["exact"] if name not in drawn["misses"]}
    marked = {f"{name}: {which}": name for name, cell in cells.items() for which in cell["misses"]}
    unexplained = marked.keys() - as_drawn
    texts = []
    for one in read_data("paper.toml")["explanation"]:
        if plant not in one.get("plants", (plant,)) or not any(
            fnmatchcase(id_, rows) for rows in one["rows"]
        ):
            continue
        explained = {
            mark
            for mark in marked.keys() & set(one["of"])
            if "by" not in one
            or _is_within_margin(cells[marked[mark]], drawn["exact"].get(marked[mark]), one["by"])
        }
        texts += [one["text"]] if explained else []
        unexplained -= explained
    return texts, sorted(unexplained)


def _is_within_margin(cell: Mapping[str, Any], drawn: float | None, by: float) -> bool:
    """Check that the exact value, or that at the sampled rate, misses the interval by at most `by`."""
    value = cell["exact"] if drawn is None else drawn
    return bool(cell["low"] - by <= value <= cell["high"] + by)


def _means(
    one: Experiment,
    rows: Sequence[Mapping[str, Any]],
    of_rows: Mapping[Row, Sequence[Findings]],
    premises: TrialInputs,
) -> list[dict[str, Any]]:
    """Pool success over tasks; where each task has as many trials, it is the mean of the shares."""
    found = []
    for variant, at in dict.fromkeys((row["variant"], row["at"]) for row in rows):
        of = [
            row for row in rows if (row["variant"], row["at"]) == (variant, at) and "success" in row["cells"]
        ]
        if len(of) < 2:
            continue
        cells = [row["cells"]["success"] for row in of]
        hits, trials = sum(cell["hits"] for cell in cells), sum(cell["of"] for cell in cells)
        computed = {name: _mean_share([cell[name] for cell in cells]) for name in COMPUTED_FIELDS}
        id_ = "/".join([str(one.number), variant, "*", *([at] if at else [])])
        paper = read_data("paper.toml")["value"].get(id_, {}).get("success")
        cell = _cell({"hits": hits, "of": trials, **_share(hits, trials)}, computed, paper)
        drawn = None
        if "exact" in cell["misses"]:
            named = {row["id"] for row in of}
            drawn = _mean_at_sampled_rate(cell, {r: f for r, f in of_rows.items() if r.id in named}, premises)
        plant = next(iter(of_rows)).condition.plant
        why, unexplained = _explanation(id_, plant, {"success": cell}, drawn)
        found.append(
            {
                "id": id_,
                "title": one.variants[variant],
                "variant": variant,
                "at": at,
                "along": of[0]["along"],
                "tasks": len(of),
                "cell": cell,
                "drawn": drawn,
                "why": why,
                "unexplained": unexplained,
            }
        )
    return found


def _mean_at_sampled_rate(
    cell: Mapping[str, Any], of_rows: Mapping[Row, Sequence[Findings]], premises: TrialInputs
) -> dict[str, Any] | None:
    """Average exact successes, each at the share of attempts that failed; see `_sampled_rate_cells`."""
    each = [exact_at_sampled_rate(row.condition, found, premises) for row, found in of_rows.items()]
    known = [one["exact"]["success"] for one in each if one is not None]
    if len(known) < len(each):
        return None
    value = 100 * fmean(known)
    return {"exact": {"success": value}, "misses": ["success"] if _is_outside(cell, value) else []}


def _mean_share(shares: Sequence[float | None]) -> float | None:
    """Average shares in percent; None where one of them is unknown."""
    known = [one for one in shares if one is not None]
    return fmean(known) / 100 if len(known) == len(shares) else None


def _test(
    one: Experiment, first: str, second: str, of_rows: Mapping[Row, Sequence[Findings]]
) -> dict[str, Any]:
    """Compare how often two variants succeed, task by task: by the paper's test, and paired by seed."""
    paper = read_data("paper.toml")["fisher"] if (first, second) == ("aeros", "behaviour_tree") else {}
    by_place = {(row.variant, row.task, row.sweep_value): found for row, found in of_rows.items()}
    compared = []
    for task, at in dict.fromkeys((row.task, row.sweep_value) for row in of_rows):
        pair = by_place.get((first, task, at)), by_place.get((second, task, at))
        if pair[0] is None or pair[1] is None:
            continue
        hits = [[bool(trial["reached"]) for trial in found] for found in pair if found is not None]
        counts = [(sum(reached), len(reached)) for reached in hits]
        alone = [a and not b for a, b in zip(*hits, strict=True)]
        other = [b and not a for a, b in zip(*hits, strict=True)]
        compared.append(
            {
                "task": task,
                "at": at,
                "counts": counts,
                "detectable": 100 * detectable_difference(*max(counts)),
                "difference": [100 * one for one in difference_interval(*counts)],
                "fisher": fisher_exact_test(*counts),
                "one_sided": fisher_exact_test(*counts, one_sided=True),
                "mcnemar": mcnemar(sum(alone), sum(other)),
                "paper": paper.get(task),
            }
        )
    return {"first": one.variants[first], "second": one.variants[second], "by_task": compared}


def corrected_tests(tests: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Add p-values that are corrected for the number of tests of an experiment.

    Args:
        tests: comparisons of one experiment, each with its tests by task.

    Returns:
        The same, with `fisher_holm` and `mcnemar_holm` for each task.
    """
    found = [{**test, "by_task": [dict(one) for one in test["by_task"]]} for test in tests]
    each = [one for test in found for one in test["by_task"]]
    for name in ("fisher", "mcnemar"):
        for one, value in zip(each, holm([one[name] for one in each]), strict=True):
            one[f"{name}_holm"] = value
    return found
