"""The same seed and plan repeat bit for bit, in another process that hashes otherwise: trace and record."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from aeros.exit_codes import Exit
from aeros.runtime.audit.check import CHECKPOINT
from tests.repo.tree import ROOT

pytestmark = pytest.mark.physics

FAULTS = """schema: aeros/faults/1
description: Of several kinds, often, so that each comes up in a few seconds.
faults:
  weak:
    at: {every: 1 s}
    rate: 0.3
    bursts: {mean_length: 3, within: 0.8}
    weaken: {torque: 0.8, lasts: 500 ms}
  late:
    at: {every: 1 s}
    rate: 0.3
    delay: {by: 25 ms, lasts: 500 ms}
  noisy:
    at: {every: 1 s}
    rate: 0.5
    misread: {of: human_distance, noise: 10 mm, lasts: 500 ms}
  hit:
    at: {every: 1 s}
    rate: 0.3
    bump: {thing: can, impulse: 0.01 N*s}
  glare:
    at: {look: table_top}
    rate: 0.6
    bursts: {mean_length: 2}
    miss: {}
"""

PERSON = """schema: aeros/people/1
description: Somebody walks up and stays.
people:
  guest:
    path:
      - {at: [3 m, 0.5 m]}
      - {at: [1.9 m, 0.2 m], speed: 1 m/s}
    spread: 50 mm
    delay: 500 ms
"""


CASES = {
    "physics": (
        "clean the table",
        "--plant",
        "physics",
        "--timeout",
        "4",
        "--faults",
        "FAULTS",
        "--people",
        "PERSON",
    ),
    "kinematic": ("clean the table", "--plant", "kinematic", "--timeout", "3"),
    "symbolic": ("make dumplings", "--plant", "symbolic"),
}
"""Instructions on each plant; people and faults where there are any."""

OF_THE_LOG_ITSELF = {"log-began", CHECKPOINT}
"""Events whose details make a log unlike any other: a nonce, times, signatures."""

SHORTER = {"physics": ("--timeout", "1")}
"""Options of a run that ends soon after its first decision."""


def decisions_in(records: list[bytes]) -> list[bytes]:
    """Return the decisions, with their readings, in order."""
    return [record for record in records if record.startswith(b'["decision"')]


def records_of(folder: Path, case: str, seed: int, hashes: int, *more: str) -> tuple[bytes, list[bytes]]:
    """Trace, and record with every reading that was decided on, of a run in its own process.

    Not of when records were written, nor of the chain over them, which has that in it. Of the first record
    and of those that sign the chain only their places count.
    """
    files = {"FAULTS": FAULTS, "PERSON": PERSON}
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)
    words = [str(folder / f"{word}.yaml") if word in files else word for word in CASES[case]]
    out = folder / f"{seed}-{hashes}"
    words += ["--seed", str(seed), "--no-film", "--ecms", str(ROOT / "ecms")]
    words += ["--state", f"{out}-state", "--out", str(out), *more]
    ended = subprocess.run(
        [sys.executable, "-m", "aeros", "run", *words],
        env={**os.environ, "PYTHONHASHSEED": str(hashes), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
    )
    assert ended.returncode in (Exit.SUCCESS, Exit.REJECTED), ended.stderr
    trace = (out / "trace.jsonl").read_bytes()
    records = [json.loads(line) for line in (out / "audit.jsonl").read_text().splitlines()]
    compared = []
    for record in records:
        details = record["details"]
        if record["event"] in OF_THE_LOG_ITSELF:
            details = {key: details[key] for key in ("sequence", "closing") if key in details}
        compared.append(json.dumps([record["event"], details], sort_keys=True).encode())
    return trace, compared


@pytest.mark.parametrize(
    "case", ["kinematic", *(pytest.param(one, marks=pytest.mark.deep) for one in ("symbolic", "physics"))]
)
def test_a_run_repeats_under_any_hash_seed_and_another_seed_is_another_run(case: str, tmp_path: Path) -> None:
    trace, records = records_of(tmp_path, case, 3, hashes=1)
    assert (b'"fault-started"' in trace) is ("FAULTS" in CASES[case])
    assert len(decisions_in(records)) >= 3
    assert records_of(tmp_path, case, 3, hashes=2) == (trace, records)
    # A shorter run is enough: with this seed, it would begin alike.
    _, others = records_of(tmp_path, case, 7, 1, *SHORTER.get(case, ()))
    assert (other := decisions_in(others))
    assert other != decisions_in(records)[: len(other)]
