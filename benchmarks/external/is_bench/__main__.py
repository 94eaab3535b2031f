"""Run IS-Bench on AEROS: `python -m benchmarks.external.is_bench DIR`.

DIR is a checked-out repository of the benchmark, github.com/AI45Lab/IS-Bench. Its files are not part of
AEROS, as its repository states no licence for them.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from aeros.exit_codes import Exit
from aeros.experiments.environment import environment
from benchmarks.command import build_parser, print_json
from benchmarks.external.is_bench.campaign import Findings, OwnPlan, find_plans, run_campaign
from benchmarks.external.is_bench.conversion.task import BenchmarkFileError

SCHEMA = "aeros/is-bench/1"


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign and print what was found.

    Args:
        arguments: of the command line.

    Returns:
        The exit code: 0; 1 if AEROS accepted a plan that the judge finds unsafe; 2 for bad arguments.
    """
    given = _parser().parse_args(arguments)
    try:
        found = run_campaign(given.folder)
        plans = [] if given.quick else list(find_plans(given.folder, given.time_limit))
    except BenchmarkFileError as why:
        print(f"is_bench: {why}", file=sys.stderr)
        return Exit.USAGE
    result = {
        "schema": SCHEMA,
        "benchmark": {"repository": "AI45Lab/IS-Bench", "commit": _commit(given.folder)},
        "environment": environment(),
        "time_limit_s": None if given.quick else given.time_limit,
        "findings": found.to_json(),
        "own_plans": [asdict(one) for one in plans],
    }
    if given.out is not None:
        given.out.write_text(json.dumps(result, indent=1) + "\n", "utf-8")
    if given.format == "json":
        print_json(result)
    else:
        print("\n".join(_lines(found, plans)))
    is_wrong = any(one.unsafe_accepted for one in found.mutants.values()) or any(
        one.accepted and not one.is_safe for one in found.examples
    )
    return Exit.REJECTED if is_wrong else Exit.SUCCESS


def _parser() -> argparse.ArgumentParser:
    parser = build_parser(__doc__, "check plans only, and let AEROS plan nothing itself")
    parser.add_argument("folder", type=Path, metavar="DIR", help="checked-out repository of the benchmark")
    parser.add_argument("--time-limit", type=float, default=60.0, help="of AEROS's own plan, s (default: 60)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write all findings as JSON")
    return parser


def _commit(folder: Path) -> str | None:
    asked = ["git", "-C", str(folder), "rev-parse", "HEAD"]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    return done.stdout.strip() or None


def _lines(found: Findings, plans: list[OwnPlan]) -> list[str]:
    accepted = sum(one.accepted for one in found.examples)
    lines = [f"example plans: {len(found.examples)}, accepted {accepted}"]
    lines += [f"  refused {one.task}: {one.reason[:120]}" for one in found.examples if not one.accepted]
    for kind, counts in found.mutants.items():
        refused = ", ".join(f"{number} as {why}" for why, number in counts.safe_refused.items())
        lines += [
            f"{kind}: {counts.mutants} mutants, {counts.unsafe} unsafe, "
            f"of these {counts.unsafe_accepted} accepted "
            f"({counts.unsafe_accepted_by_control} by the control)",
            f"  {counts.safe_accepted} safe and accepted; safe and refused: {refused or 'none'}",
        ]
    lines += [f"unexplained: {one}" for one in found.unexplained]
    lines += [f"not converted: {task}: {why}" for task, why in found.left_out.items()]
    if plans:
        outcomes = Counter(one.outcome for one in plans)
        lines.append(f"own plans: {', '.join(f'{number} {what}' for what, number in outcomes.most_common())}")
    return lines


if __name__ == "__main__":
    sys.exit(main())
