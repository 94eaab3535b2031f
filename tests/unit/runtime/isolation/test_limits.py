"""A worker's resources are limited for good: on every host, as every Linux has these limits."""

from __future__ import annotations

import json
import resource
import subprocess
import sys

from aeros.runtime.isolation.limits import CPU, FILES, MEMORY

NOTHING = ("RLIMIT_CORE", "RLIMIT_FSIZE", "RLIMIT_MEMLOCK", "RLIMIT_MSGQUEUE", "RLIMIT_NPROC")
"""Resources whose limit is 0 for a worker."""

LIMITED = """
import json, resource
from aeros.runtime.isolation.limits import restrict_resources
pages = int(open("/proc/self/statm").read().split()[0])
restrict_resources()
found = {name: resource.getrlimit(getattr(resource, name)) for name in
    ("RLIMIT_CPU", "RLIMIT_CORE", "RLIMIT_FSIZE", "RLIMIT_MEMLOCK", "RLIMIT_MSGQUEUE", "RLIMIT_NPROC",
     "RLIMIT_NOFILE", "RLIMIT_AS")}
try:
    bytearray(2 * MEMORY)
    found["memory"] = "to be had"
except MemoryError:
    found["memory"] = "none"
try:
    files = [open("/dev/null") for _ in range(FILES)]
except OSError:
    found["files"] = "none"
print(json.dumps([pages * resource.getpagesize(), found]))
"""


def test_every_limit_is_set_for_good_and_holds() -> None:
    constants = f"MEMORY, FILES = {MEMORY}, {FILES}\n"
    ran = subprocess.run(
        [sys.executable, "-c", constants + LIMITED], capture_output=True, text=True, check=True
    )
    mapped, found = json.loads(ran.stdout)
    soft, hard = found.pop("RLIMIT_AS")
    assert soft == hard
    assert mapped + MEMORY <= soft < mapped + MEMORY + 8 * 1024 * 1024
    assert found == {
        "RLIMIT_CPU": [CPU, CPU],
        "RLIMIT_NOFILE": [FILES, FILES],
        **{name: [0, 0] for name in NOTHING},
        "memory": "none",
        "files": "none",
    }


def test_this_process_is_not_limited_by_it() -> None:
    assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] > FILES
