"""Compare the two physics engines: the same tasks from the same starts on PyBullet and on MuJoCo.

`python -m benchmarks.engines.sim_to_sim --runs 4` runs each case as benchmarks/starts.py does, first on
`--plant physics` and then on `--plant mujoco`, and prints a table in Markdown: how often the goal was true in
the simulator and how often it was claimed falsely, steps that the monitor stopped, simulated time, the
greatest contact force and the least distance of a person that were measured, and processor time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from benchmarks.command import build_parser, print_json
from benchmarks.starts import run_once, summarize

_PLANTS: Final = ("physics", "mujoco")

_HEADER: Final = (
    "| task | plant | reached | false claims | stops | simulated, s | force, N | person, m | processor, s |"
)


class Case(NamedTuple):
    """A task, and the options of `aeros run` that make it harder."""

    instruction: str
    options: tuple[str, ...] = ()


CASES: Final = (
    Case("make dumplings"),
    Case("clean the table"),
    Case("bring me the red can"),
    Case("clean the table", ("--faults", "sponge_dropped")),
    Case("bring me the red can", ("--faults", "object_slips", "--people", "across_the_room")),
)


def measure(case: Case, plant: str, seeds: Sequence[int]) -> dict[str, Any]:
    """Run a case on a plant, and return the figures of all runs together."""
    options = ("--no-film", "--plant", plant, *case.options)
    runs = [run_once(case.instruction, options, None, seed) for seed in seeds]
    forces = [run["force_max"] for run in runs if run["force_max"] is not None]
    distances = [run["distance_min"] for run in runs if run["distance_min"] is not None]
    return {
        "instruction": case.instruction,
        "options": case.options,
        "plant": plant,
        **summarize(runs),
        "force_max": max(forces, default=None),
        "distance_min": min(distances, default=None),
    }


def format_row(row: dict[str, Any]) -> str:
    """Format the figures of a case on a plant as a row of the table."""
    runs = row["runs"]
    extra = " ".join(one for one in row["options"] if not one.startswith("--"))
    cells = (
        row["instruction"] + (f" ({extra})" if extra else ""),
        row["plant"],
        f"{row['reached']} of {runs}",
        row["false_claims"],
        row["stops"],
        f"{row['simulated_s'] / runs:.1f}",
        f"{row['force_max']:.1f}",
        f"{row['distance_min']:.2f}",
        f"{row['processor_s'] / runs:.1f}",
    )
    return "| " + " | ".join(map(str, cells)) + " |"


def main() -> None:
    """Run, and print each row as its runs end."""
    parser = build_parser(__doc__, quick="one case, one run")
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0, help="the first seed")
    arguments = parser.parse_args()
    seeds = range(arguments.first_seed, arguments.first_seed + (1 if arguments.quick else arguments.runs))
    if arguments.format == "text":
        print(_HEADER)
        print("|---|---|---|---|---|---|---|---|---|")
    rows = []
    for case in CASES[2:3] if arguments.quick else CASES:
        for plant in _PLANTS:
            rows.append(measure(case, plant, seeds))
            if arguments.format == "text":
                print(format_row(rows[-1]), flush=True)
    if arguments.format == "json":
        print_json(rows)


if __name__ == "__main__":
    main()
