"""Fixtures of the tests of execution: the reference site."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


@pytest.fixture(scope="session")
def cell() -> Site:
    """The site that comes with AEROS."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site
