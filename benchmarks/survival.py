"""Kill agents, workers and watchdogs at random instants: `python -m benchmarks.survival --trials 200`.

`aeros/experiments/trials/kills.py` describes a trial and its checks; `aeros experiment 12` tries each victim
by itself.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Final

from aeros.experiments.inputs import InputPaths, load_inputs
from aeros.experiments.trials.kill_logs import PLANTS
from aeros.experiments.trials.kills import VICTIMS, KillTrial, measure_duration, trial_of
from benchmarks.command import build_parser, print_json

_INPUT_PATHS: Final = InputPaths(str(Path(__file__).parents[1] / "ecms"))
_INSTRUCTION: Final = "make dumplings"


def main() -> None:
    """Run the trials and print their results."""
    parser = build_parser(__doc__, "two trials")
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--first-seed", type=int, default=0, help="the first seed")
    parser.add_argument("--plant", choices=PLANTS, default="symbolic")
    parser.add_argument("--lasting", type=float, help="seconds in which kills fall (default: measured)")
    arguments = parser.parse_args()
    trials = 2 if arguments.quick else arguments.trials
    lasting = arguments.lasting or measure_duration(arguments.plant, _INPUT_PATHS, _INSTRUCTION)
    known = load_inputs(_INPUT_PATHS).configuration.modules
    each: list[KillTrial] = []
    for seed in range(arguments.first_seed, arguments.first_seed + trials):
        each.append(trial_of(seed, arguments.plant, known, lasting, _INPUT_PATHS, _INSTRUCTION))
        if arguments.format == "text":
            result = each[-1].violations or (
                "goal reached" if each[-1].reached else f"goal not reached: {each[-1].failure_reason}"
            )
            print(f"seed {seed}: {', '.join(each[-1].kills) or 'nobody'} killed; {result}", flush=True)
    kills = Counter(victim for one in each for victim in one.kills)
    found = {
        "plant": arguments.plant,
        "trials": trials,
        "kills": {victim: kills[victim] for victim in VICTIMS},
        "recovered": sum(one.recovered for one in each),
        "resumed": sum(one.resumed for one in each),
        "amid_motion": sum(one.kills_in_motion for one in each),
        "reached": sum(one.reached for one in each),
        "broken": sum(bool(one.violations) for one in each),
    }
    if arguments.format == "json":
        print_json({**found, "each": [asdict(one) for one in each]})
        return
    for name, value in found.items():
        print(f"{name:12} {value}")


if __name__ == "__main__":
    main()
