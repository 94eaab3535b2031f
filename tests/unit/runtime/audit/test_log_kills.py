"""A writer is killed at random moments: whatever it acknowledged is in the log, which goes on.

The writer's writes are slow and in pieces, so that kills leave torn records: by itself the kernel writes
a record of this size at once.
"""

from __future__ import annotations

import json
import os
import signal
import struct
import time
import warnings
from datetime import date
from pathlib import Path
from random import Random
from typing import Any

import pytest

from aeros.runtime.audit.check import TAIL_REPAIRED
from aeros.runtime.audit.checkpoints import SigningConfiguration, verify_signed
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog, verify_log

LONGEST = 0.08
PIECE = 60
ACKNOWLEDGED = struct.Struct("<QQ")
STARTED = b"!"


def append_for_ever(log: Path, signing: SigningConfiguration | None, acknowledge: int, first: int) -> None:
    """Say that it has begun by a byte, then each record that is durable."""
    os.write(acknowledge, STARTED)
    pwrite = os.pwrite

    def slow(file: int, data: Any, at: int) -> int:
        time.sleep(0.0002)
        return pwrite(file, data[:PIECE], at)

    os.pwrite = slow
    opened = AuditLog(log, signing=signing)
    number = first
    while True:
        sequence = opened.append("event", {"number": number, "filler": "x" * 300})
        os.write(acknowledge, ACKNOWLEDGED.pack(sequence, number))
        number += 1


def acknowledged_until_killed(
    log: Path, signing: SigningConfiguration | None, first: int, records: int, lives: float
) -> dict[int, int]:
    """Kill a writer `lives` s after `records` records; return its acknowledgements by sequence number."""
    read, write = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the child touches nothing that threads share
        child = os.fork()
    if child == 0:
        try:
            append_for_ever(log, signing, write, first)
        finally:
            os._exit(1)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        # By what it has done and not by the clock: a busy machine may not even start it for long.
        assert pipe.read(1) == STARTED
        message = pipe.read(records * ACKNOWLEDGED.size)
        time.sleep(lives)
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        message += pipe.read()
    assert os.WIFSIGNALED(status), "the writer ended by itself"
    return dict(ACKNOWLEDGED.iter_unpack(message))


@pytest.mark.parametrize(
    ("kills", "seed"),
    [
        pytest.param(25, 4, id="25 kills, the same instants every time"),
        pytest.param(
            100, date.today().toordinal(), marks=pytest.mark.deep, id="100 kills, a seed of the day"
        ),
    ],
)
@pytest.mark.parametrize("signs", [False, True])
def test_no_acknowledged_record_is_lost_in_many_kills(
    signs: bool, kills: int, seed: int, tmp_path: Path
) -> None:
    log, anchor = tmp_path / "audit.jsonl", tmp_path / "anchor"
    make_key(tmp_path / "key")
    signing = SigningConfiguration(read_signing_key(tmp_path / "key"), (anchor,)) if signs else None
    chance = Random(seed)  # noqa: S311 - draws instants, not secrets
    acknowledged: dict[int, int] = {}
    torn = 0
    for kill in range(kills):
        records, lives = chance.randrange(4), chance.uniform(0, LONGEST)
        acknowledged |= acknowledged_until_killed(log, signing, kill << 32, records, lives)
        torn += "cut short" in verify_log(log).reason
    AuditLog(log, signing=signing).close()
    kept = [json.loads(line) for line in log.read_bytes().splitlines()]
    assert {number: kept[number]["details"]["number"] for number in acknowledged} == acknowledged
    # A kill may also tear the note that an earlier one tore a record.
    assert torn >= sum(record["event"] == TAIL_REPAIRED for record in kept) > 0
    assert len(acknowledged) > kills // 2
    if signing is None:
        assert verify_log(log).is_sound
    else:
        report = verify_signed(log, signing.key.public, anchor)
        assert (report.chain.reason, report.anchored) == ("", len(kept))
