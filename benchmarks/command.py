"""Options that the command lines of all benchmarks share: a quick run, and figures as tables or as JSON."""

from __future__ import annotations

import argparse
import json
from typing import Any


def build_parser(description: str | None, quick: str) -> argparse.ArgumentParser:
    """Build a parser with `--format` and `--quick`; `quick` is the help text of the latter."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--format", choices=("text", "json"), default="text")
    parser.add_argument("--quick", action="store_true", help=f"{quick}, to see that it works")
    return parser


def print_json(found: Any) -> None:
    """Print the figures as JSON."""
    print(json.dumps(found, indent=1))
