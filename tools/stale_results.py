"""List the kept results that were made with other code, modules or site: `python -m tools.stale_results`.

Exits with 1 if there are any: a release needs results of its own code.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from aeros.experiments.inputs import InputPaths, load_inputs
from aeros.experiments.report.write import RESULTS, is_stale


def main() -> int:
    """Compare each folder of docs/results with what there is now.

    Returns:
        1 if one of them is stale, else 0.
    """
    sources = load_inputs(InputPaths("ecms")).sources_digest
    paths = sorted(Path("docs/results").glob(f"*/{RESULTS}"))
    stale = [path for path in paths if is_stale(json.loads(path.read_text(encoding="utf-8")), sources)]
    for path in stale:
        print(f"{path.parent} is stale: run its experiments again, and put the report there")
    print(f"{len(stale)} of {len(paths)} results are stale")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
