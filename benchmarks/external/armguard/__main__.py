"""Put armguard-mcp's plans beside its keep-out box to AEROS's gate.

`python -m benchmarks.external.armguard URDF`. The plans are those of `workload.json`, which
`make_workload.py` asked of the server. URDF is the arm with its collision meshes, for the judge (`pip install
pin coal`); `franky_sim/assets/fr3.urdf` of the package franky-sim 1.0.4 has those of the FR3.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from aeros.experiments.environment import environment
from benchmarks.command import build_parser, print_json
from benchmarks.external.armguard.gate_check import ZoneGate, cell_with_zones
from benchmarks.external.armguard.judge import MeshJudge

SCHEMA: Final = "aeros/armguard/1"

WORKLOAD: Final = Path(__file__).with_name("workload.json")


@dataclass(frozen=True)
class MotionVerdicts:
    """Verdicts on one motion.

    Attributes:
        by_armguard: True if armguard-mcp accepted it.
        by_aeros: True if AEROS's gate allows it.
        zones: boxes that AEROS refuses it for.
        others: its other reasons.
        hulls_are_clear: True if the check by hulls finds the box clear.
        distance: the judge's least distance of a link from the box, m; at most 0 inside it.
    """

    by_armguard: bool
    by_aeros: bool
    zones: tuple[str, ...]
    others: tuple[str, ...]
    hulls_are_clear: bool
    distance: float


def judge_workload(workload: Mapping[str, Any], urdf: Path, count: int | None = None) -> list[MotionVerdicts]:
    """Decide and judge every motion that has an end.

    Args:
        workload: zones and motions.
        urdf: the arm, for the judge.
        count: number of motions; all if None.

    Returns:
        The verdicts.
    """
    zones = [zone for zone in workload["zones"] if zone["name"] == "camera_mount"]
    gate, judge = ZoneGate(cell_with_zones(zones), zones), MeshJudge(urdf, zones)
    found = []
    for motion in [one for one in workload["motions"] if one["end"] is not None][:count]:
        verdict = gate.decide(motion["start"], motion["end"])
        distance = min(judge.distance(motion["start"], motion["end"]).values())
        found.append(
            MotionVerdicts(
                motion["accepted"],
                verdict.is_allowed,
                verdict.zones,
                verdict.others,
                verdict.hulls_are_clear,
                distance,
            )
        )
    return found


def summarize(motions: Sequence[MotionVerdicts], clearance: float) -> dict[str, Any]:
    """Count the verdicts.

    Args:
        motions: the verdicts.
        clearance: distance that the site keeps from the box, m.

    Returns:
        The counts.
    """
    allowed = [one for one in motions if not one.zones]
    refused = [one for one in motions if one.zones]
    needless = sorted(one.distance for one in refused if one.distance >= clearance)
    accepted = [one for one in motions if one.by_armguard]
    return {
        "motions": len(motions),
        "inside": sum(one.distance <= 0.0 for one in motions),
        "nearer_than_clearance": sum(one.distance < clearance for one in motions),
        "armguard_accepts": len(accepted),
        "armguard_accepts_inside": sum(one.distance <= 0.0 for one in accepted),
        "aeros_allows": len(allowed),
        "aeros_allows_inside": sum(one.distance <= 0.0 for one in allowed),
        "aeros_allows_nearer_than_clearance": sum(one.distance < clearance for one in allowed),
        "aeros_least_distance_m": min((one.distance for one in allowed), default=None),
        "aeros_refuses": len(refused),
        "aeros_refuses_needlessly": len(needless),
        "needless_distances_m": [round(one, 4) for one in needless],
        "hulls_clear": sum(one.hulls_are_clear for one in motions),
        "hulls_clear_nearer_than_clearance": sum(
            one.hulls_are_clear and one.distance < clearance for one in motions
        ),
        "refused_for_other_reasons": sum(bool(one.others) for one in motions),
    }


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark and print its counts.

    Args:
        arguments: of the command line.

    Returns:
        The exit code: 0; 1 if AEROS allows a motion with a link in the box.
    """
    parser = build_parser(__doc__, "ten motions")
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("urdf", type=Path, metavar="URDF", help="the arm with its collision meshes")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write verdicts and counts as JSON")
    given = parser.parse_args(arguments)
    workload = json.loads(WORKLOAD.read_text("utf-8"))
    motions = judge_workload(workload, given.urdf, 10 if given.quick else None)
    zones = workload["zones"]
    clearance = ZoneGate(cell_with_zones(zones), zones).clearance
    counts = summarize(motions, clearance)
    result = {
        "schema": SCHEMA,
        "workload": workload["source"],
        "targets": len(workload["motions"]),
        "clearance_m": clearance,
        "environment": environment(),
        "counts": counts,
        "motions": [asdict(one) for one in motions],
    }
    if given.out is not None:
        given.out.write_text(json.dumps(result, indent=1) + "\n", "utf-8")
    if given.format == "json":
        print_json(result)
    else:
        print("\n".join(f"{name}: {value}" for name, value in counts.items()))
    return int(counts["aeros_allows_inside"] > 0)


if __name__ == "__main__":
    sys.exit(main())
