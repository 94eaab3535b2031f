"""PyBullet is imported without its banner, and both streams work afterwards."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.physics


def test_the_import_prints_nothing() -> None:
    code = "import sys, aeros.sim.bullet.client; print('out'); print('err', file=sys.stderr)"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (ended.stdout, ended.stderr) == ("out\n", "err\n")


@pytest.mark.parametrize("closed", [[1], [2], [1, 2]])
def test_a_closed_stream_stays_closed(closed: list[int]) -> None:
    code = f"""
import os
for stream in {closed}:
    os.close(stream)
import aeros.sim.bullet.client
for stream in {closed}:
    try:
        os.fstat(stream)
    except OSError:
        continue
    os._exit(1)
os._exit(0)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
