"""Name of the file with the poses of a run, which needs no simulator to be known."""

from __future__ import annotations

from typing import Final

FILE: Final = "poses.jsonl"
"""Name of the file in the folder of a run."""
