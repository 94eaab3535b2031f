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
