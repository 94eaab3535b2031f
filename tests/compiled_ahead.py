"""Compilation of all tests before the processes of one run start, which would each compile all of them."""

from __future__ import annotations

from compileall import compile_dir, compile_file
from pathlib import Path
from typing import Final

import pytest
from _pytest.assertion import rewrite

_TESTS: Final = Path(__file__).parent


def compile_ahead(config: pytest.Config) -> None:
    """Leave to the processes of a run nothing to compile: each would rewrite the `assert`s of 600 files.

    Nothing breaks where this leaves a file out, or compiles one that no process reads.

    Args:
        config: of the process that starts the others, on which nothing else runs yet.
    """
    compile_dir(_TESTS.parent / "aeros", quiet=2)
    state = config.stash[rewrite.assertstate_key]
    stale = []
    for path in sorted(_TESTS.rglob("*.py")):
        if not path.match("test_*.py") and path.name != "conftest.py":
            compile_file(path, quiet=2)
        elif rewrite._read_pyc(path, _place(path)) is None:
            stale.append(path)
    for path in stale:
        source_hash, code = rewrite._rewrite_test(path, config)
        rewrite.try_makedirs(_place(path).parent)
        rewrite._write_pyc(state, code, source_hash, _place(path))


def _place(path: Path) -> Path:
    return rewrite.get_cache_dir(path) / (path.stem + rewrite.PYC_TAIL)
