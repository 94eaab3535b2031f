"""Catalogue of experiments, read from data: each is a table of conditions and the metrics to show."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, Final

from aeros.experiments.architecture import BUILT_IN, load_class
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import digest_of_files
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.errors import MisuseError

_PACKAGED: Final = Path(__file__).parent / "data"
_DATA: Final = _PACKAGED if _PACKAGED.is_dir() else Path(__file__).parents[2] / "experiments"
"""Experiments, their faults and modules: in the installed package, or in the repository."""

PLANTS: Final = ("physics", "symbolic")

_METRIC_FIELDS: Final = {"of": "denominator", "hits": "numerator", "most": "maximum"}
"""Fields of a `Metric` by their names in `experiments.toml`, where the two differ."""


@dataclass(frozen=True, slots=True)
class Metric:
    """A metric of trials: a share, a mean, a median or a maximum of one of their findings.

    A share is that of the trials in which `denominator` is true, or of `numerator` in the sum of
    `denominator`.

    Attributes:
        name: its name in the data.
        title: its name for people.
        denominator: finding that a share counts.
        numerator: finding that is summed over that of `denominator`; empty for a share of the trials.
        mean: finding whose mean is shown.
        median: finding whose median is shown.
        maximum: finding whose maximum is shown.
        exact: name of the expected value; empty where there is none.
    """

    name: str
    title: str
    denominator: str = ""
    numerator: str = ""
    mean: str = ""
    median: str = ""
    maximum: str = ""
    exact: str = ""

    @property
    def is_share(self) -> bool:
        """True for a share, which has an interval."""
        return self.denominator != ""


@dataclass(frozen=True, slots=True)
class Row:
    """A condition in its place in an experiment.

    Attributes:
        id: path of the row, as `4/flat/clean_table`.
        labels: the same for people.
        condition: settings of the trials of this row.
        variant: name of the variant.
        task: name of the task; empty where there is none.
        rate: rate of failure, as text; empty where there is none.
        architecture: name of the variant's architecture.
        sweep_value: number in which the row differs from others of its variant and task, as in its id.
        sweep_axis: quantity and unit of that number.
    """

    id: str
    labels: tuple[str, ...]
    condition: TrialCondition
    variant: str = ""
    task: str = ""
    rate: str = ""
    architecture: str = ""
    sweep_value: str = ""
    sweep_axis: str = ""


@dataclass(frozen=True, slots=True)
class Experiment:
    """A table of rows.

    Attributes:
        number: of the experiment.
        title: its name for people.
        metrics: columns of the table.
        rows: conditions.
        variants: titles of variants by name.
        compared_pairs: pairs of variants whose success is compared task by task.
        overhead: True if the time of a trial is shown for each variant, where the plant takes almost none.
        figure: kind of the experiment's figure; empty for none.
        plotted_metrics: metrics that are plotted along what is varied.
        note: remark below the table.
    """

    number: int
    title: str
    metrics: tuple[Metric, ...]
    rows: tuple[Row, ...]
    variants: Mapping[str, str]
    compared_pairs: tuple[tuple[str, str], ...] = ()
    overhead: bool = False
    figure: str = ""
    plotted_metrics: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True, slots=True)
class EnteredArchitecture:
    """An architecture that a user enters.

    Attributes:
        architecture: `package.module:Class`.
        options: keyword arguments of its constructor.
    """

    architecture: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of its rows: that of the class."""
        return self.architecture.rpartition(":")[2]


def catalogue(plant: str, entries: Sequence[EnteredArchitecture] = ()) -> dict[int, Experiment]:
    """Read every experiment that runs on a plant.

    Args:
        plant: `physics` or `symbolic`.
        entries: further architectures, for experiments that compare architectures.

    Returns:
        Experiments by number, in order.

    Raises:
        MisuseError: two architectures have one name.
    """
    data = read_data("experiments.toml")
    for entry in entries:
        if entry.name in data["variant"] or [one.name for one in entries].count(entry.name) > 1:
            raise MisuseError(f"`{entry.architecture}`: another architecture is called `{entry.name}`, too")
    metrics = {
        name: Metric(name, **{_METRIC_FIELDS.get(key, key): value for key, value in one.items()})
        for name, one in data["metric"].items()
    }
    found = {}
    for one in data["experiment"]:
        if plant not in one.get("plants", PLANTS):
            continue
        entered = {entry.name: entry for entry in entries} if one.get("enter", False) else {}
        titles = {name: data["variant"][name]["title"] for name in one.get("variants", ())}
        titles |= {name: f"{entry.architecture} (entered)" for name, entry in entered.items()}
        rows = [
            *_task_rows(one, data, plant, entered),
            *_listed_rows(one, data, one.get("plant", plant)),
        ]
        found[one["number"]] = Experiment(
            one["number"],
            one["title"],
            tuple(metrics[name] for name in one["metrics"]),
            tuple(rows),
            titles,
            tuple((first, second) for first, second in one.get("compared", ())),
            one.get("overhead", False) and plant == "symbolic",
            one.get("figure", ""),
            tuple(one.get("drawn", ())),
            one.get("note", ""),
        )
    return dict(sorted(found.items()))


def select_rows(experiments: Mapping[int, Experiment], names: Iterable[str]) -> list[Experiment]:
    """Select experiments and rows by name.

    Args:
        experiments: experiments by number.
        names: each is `all`, a number, or the beginning of a row's id.

    Returns:
        The experiments, each with its selected rows alone.

    Raises:
        MisuseError: a name selects nothing.
    """
    wanted: dict[int, dict[str, Row]] = {}
    for name in names:
        rows = [
            (number, row)
            for number, one in experiments.items()
            for row in one.rows
            if name == "all" or f"{row.id}/".startswith(name.rstrip("/") + "/")
        ]
        if not rows:
            ids = [str(number) for number in experiments]
            ids += [row.id for one in experiments.values() for row in one.rows]
            near = did_you_mean(name, ids)
            hint = f"did you mean `{near}`?" if near else "`aeros experiment list` shows all there are"
            if plants := _plants_of(name):
                hint = f"it is tried with `--plant {plants[0]}`"
            raise MisuseError(f"there is no experiment `{name}`; {hint}")
        for number, row in rows:
            wanted.setdefault(number, {})[row.id] = row
    return [
        replace(one, rows=tuple(row for row in one.rows if row.id in wanted[number]))
        for number, one in experiments.items()
        if number in wanted
    ]


def _plants_of(name: str) -> Sequence[str]:
    """Return the plants that the experiment of that name is restricted to."""
    number = name.partition("/")[0]
    experiments = read_data("experiments.toml")["experiment"]
    return next(
        (one["plants"] for one in experiments if str(one["number"]) == number and "plants" in one), ()
    )


@cache
def read_data(name: str) -> dict[str, Any]:
    """Read a TOML file of the folder `data`.

    Args:
        name: name of the file.

    Returns:
        Its content, cached; do not change it.
    """
    return tomllib.loads((_DATA / name).read_text(encoding="utf-8"))


def _task_rows(
    one: Mapping[str, Any], data: Mapping[str, Any], plant: str, entered: Mapping[str, EnteredArchitecture]
) -> Iterator[Row]:
    variants = {name: data["variant"][name] for name in one.get("variants", ())}
    for name, entry in entered.items():
        variants[name] = {
            "title": entry.architecture,
            "architecture": entry.architecture,
            "options": entry.options,
        }
    for variant, settings in variants.items():
        for task in one["tasks"]:
            failure = data["task"][task]
            for at, label, rate, changed in _variation(one, settings, failure):
                id_ = [str(one["number"]), variant, task, *([at] if at else [])]
                labels = [settings["title"], failure["title"], f"{float(100 * Fraction(rate)):g} %"]
                labels += [label] if label else []
                made = {**_task_settings(settings, task, failure, rate, plant), **changed}
                named = (variant, task, rate, settings["architecture"], at, one.get("along", ""))
                yield Row("/".join(id_), tuple(labels), TrialCondition.create("task", plant, made), *named)


def _variation(
    one: Mapping[str, Any], variant: Mapping[str, Any], failure: Mapping[str, Any]
) -> Iterator[tuple[str, str, str, Mapping[str, Any]]]:
    """Yield what rows of a variant and task differ in: a number, its label, the rate, changed settings."""
    rate = one.get("rate", failure["rate"])
    if "budgets" in one:
        for name, budget in one["budgets"].items():
            yield (
                name,
                budget["title"],
                rate,
                {"budget": {key: budget[key] for key in budget.keys() - {"title"}}},
            )
    elif "rates" in one:
        yield from ((rate, "", rate, {}) for rate in one["rates"])
    elif "bursts" in one:
        for length in one["bursts"]:
            yield length, f"in bursts of {length}", rate, {"bursts": {"mean_length": length}}
    elif "latencies" in one:
        for latency in one["latencies"]:
            slow = dict.fromkeys(variant["slow"], float(latency))
            yield latency, f"{latency} s", rate, {"options": {**variant["options"], **slow}}
    else:
        yield "", "", rate, {}


def _task_settings(
    variant: Mapping[str, Any], task: str, failure: Mapping[str, Any], rate: str, plant: str
) -> dict[str, Any]:
    """Collect everything that decides these trials besides modules, site and the code of AEROS."""
    settings = {
        "task": task,
        "architecture": variant["architecture"],
        "options": dict(variant.get("options", {})),
        "policy": variant.get("policy", True),
        "skill": failure["skill"],
        "outcome": failure["outcome"],
        "rate": str(Fraction(rate)),
    }
    if variant["architecture"] not in BUILT_IN:
        settings["source"] = _source_digest(variant["architecture"])
    if plant == "physics":
        settings["faults"] = (_DATA / "faults" / failure["faults"]).read_text(encoding="utf-8")
    return settings


@cache
def _source_digest(architecture: str) -> str:
    """Digest the file that an entered architecture is in; its author answers for what else it imports."""
    import inspect

    file = Path(inspect.getfile(load_class(architecture)))
    return digest_of_files({file.name: file})


def _listed_rows(one: Mapping[str, Any], data: Mapping[str, Any], plant: str) -> Iterator[Row]:
    """Yield each row, once for each entry of `across` and each value of its `sweep`."""
    for row in one.get("row", ()):
        # A separate data file decides the trials as well, so its first list is in the condition.
        listed = {name: next(iter(read_data(file).values())) for name, file in row.get("data", {}).items()}
        texts = {name: _read_texts(folder) for name, folder in row.get("files", {}).items()}
        tasks = {
            name: _task_settings(data["variant"]["aeros"], task, failure, failure["rate"], plant)
            for name, task in row.get("tasks", {}).items()
            for failure in [data["task"][task]]
        }
        own = {**one.get("settings", {}), **row.get("settings", {}), **listed, **texts, **tasks}
        sweep = row.get("sweep", {"values": [""]})
        for across, at in product(one.get("across", [{}]), sweep["values"]):
            names = [str(one["number"]), row["name"], *([across["name"]] if across else [])]
            labels = [row["title"], *([across["title"]] if across else [])]
            labels += ["", "", f"{at} {sweep['unit']}"] if at else []
            settings = {**own, **across.get("settings", {}), **({sweep["setting"]: at} if at else {})}
            condition = TrialCondition.create(one["kind"], plant, settings)
            id_ = "/".join([*names, *([at] if at else [])])
            yield Row(
                id_, tuple(labels), condition, row["name"], sweep_value=at, sweep_axis=sweep.get("along", "")
            )


@cache
def _read_texts(folder: str) -> dict[str, str]:
    """Read each file of a folder of `data`, by name."""
    files = sorted(path for path in (_DATA / folder).iterdir() if path.is_file())
    return {path.name: path.read_text(encoding="utf-8") for path in files}
