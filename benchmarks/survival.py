"""Kills agents, workers and watchdogs at random instants: `python -m benchmarks.survival --trials 200`.

What a trial is, and what is checked, aeros/experiments/trials/kills.py says; `aeros experiment 12` tries each
victim by itself.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Final

from aeros.experiments.inputs import Where, premises_of
from aeros.experiments.trials.kill_logs import PLANTS
from aeros.experiments.trials.kills import VICTIMS, Trial, lasts, trial_of
from benchmarks.command import parser_of, print_json

_WHERE: Final = Where(str(Path(__file__).parents[1] / "ecms"))


def main() -> None:
    """Run the trials and say what came of them."""
    parser = parser_of(__doc__, "two trials")
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--plant", choices=PLANTS, default="symbolic")
    parser.add_argument("--lasting", type=float, help="seconds in which kills fall (default: measured)")
    arguments = parser.parse_args()
    trials = 2 if arguments.quick else arguments.trials
    lasting = arguments.lasting or lasts(arguments.plant, _WHERE)
    known = premises_of(_WHERE).configuration.modules
    each: list[Trial] = []
    for seed in range(arguments.first, arguments.first + trials):
        each.append(trial_of(seed, arguments.plant, known, lasting, _WHERE))
        if arguments.format == "text":
            told = each[-1].broken or (
                "goal reached" if each[-1].reached else f"goal not reached: {each[-1].missed}"
            )
            print(f"seed {seed}: {', '.join(each[-1].kills) or 'nobody'} killed; {told}", flush=True)
    kills = Counter(victim for one in each for victim in one.kills)
    found = {
        "plant": arguments.plant,
        "trials": trials,
        "kills": {victim: kills[victim] for victim in VICTIMS},
        "recovered": sum(one.recovered for one in each),
        "resumed": sum(one.resumed for one in each),
        "amid_motion": sum(one.amid_motion for one in each),
        "reached": sum(one.reached for one in each),
        "broken": sum(bool(one.broken) for one in each),
    }
    if arguments.format == "json":
        print_json({**found, "each": [asdict(one) for one in each]})
        return
    for name, value in found.items():
        print(f"{name:12} {value}")


if __name__ == "__main__":
    main()
