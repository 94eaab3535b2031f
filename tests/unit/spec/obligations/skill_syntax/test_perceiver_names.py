"""Perceivers use what numpy computes with, and nothing of it that reaches files, memory or settings."""

from __future__ import annotations

import ast

import numpy as np
import pytest

import aeros.perception
from aeros.spec.obligations.skill_syntax.allowed_syntax import first_refusal
from aeros.spec.obligations.skill_syntax.perceiver_names import (
    INTERFACE_MEMBERS,
    LINALG_MEMBERS,
    NUMPY_MEMBERS,
    PERCEIVER_NAMES,
)


def refusal(code: str) -> str | None:
    found = first_refusal(ast.parse(code), PERCEIVER_NAMES)
    return None if found is None else found.description


@pytest.mark.parametrize(
    "code",
    [
        "import numpy as np\nx = np.array([1.0, 2.0]).mean()",
        "import numpy as np\nx = np.linalg.norm(np.zeros(3))",
        "from numpy import linalg\nx = linalg.norm",
        "from numpy.linalg import norm, svd",
        "from aeros.perception import View, Perception, estimate, fit_plane, point_cloud",
        "def f(view):\n    return view.pictures['overhead'].points()[..., 2].max(axis=0)",
        "import math\nx = math.pi",
    ],
)
def test_names_that_compute_are_accepted(code: str) -> None:
    assert refusal(code) is None


_FURTHER = (
    "DataSource array2string binary_repr char ctypeslib dtype errstate f2py frombuffer fromfile fromfunction "
    "fromregex fromstring genfromtxt get_include info lib load loadtxt memmap ndarray nditer random rec "
    "require save savetxt savez set_printoptions seterr seterrcall show_config testing vectorize"
)


@pytest.mark.parametrize("name", _FURTHER.split())
def test_names_that_reach_further_are_refused(name: str) -> None:
    assert refusal(f"import numpy as np\nx = np.{name}") == f"uses `{name}` of `numpy`"
    assert refusal(f"from numpy import {name}") == f"imports `{name}` from `numpy`"


@pytest.mark.parametrize(
    ("code", "description"),
    [
        ("import numpy as np\nx = np", "passes the module `np` around"),
        ("import numpy as np\nx = np.linalg", "passes the module `np.linalg` around"),
        ("import numpy as np\nx = np.linalg.lapack_lite", "uses `lapack_lite` of `numpy.linalg`"),
        ("import numpy.linalg", "imports `numpy.linalg`"),
        ("from aeros.skill import act", "imports `act` from `aeros.skill`"),
        ("from aeros.perception import np", "imports `np` from `aeros.perception`"),
        ("import aeros.perception", "imports `aeros.perception`"),
        *((f"x = [1].{name}", f"reads the attribute `{name}`, which no plain value has")
          for name in ("base", "ctypes", "data", "dump", "resize", "strides", "tobytes", "tofile", "view")),
        ("import os", "imports `os`"),
    ],
)  # fmt: skip
def test_doors_of_arrays_and_modules_are_shut(code: str, description: str) -> None:
    assert refusal(code) == description


def test_skills_still_have_no_numpy() -> None:
    found = first_refusal(ast.parse("import numpy as np"))
    assert found is not None
    assert found.description == "imports `numpy`"


def test_every_listed_name_exists() -> None:
    assert [name for name in sorted(NUMPY_MEMBERS) if not hasattr(np, name)] == []
    assert [name for name in sorted(LINALG_MEMBERS) if not hasattr(np.linalg, name)] == []
    assert frozenset(aeros.perception.__all__) == INTERFACE_MEMBERS
    assert all(
        name in PERCEIVER_NAMES.attributes for name in ("rgb", "depth", "readings", "samples", "points")
    )
