"""A stored second of a run: a person walks up, the arm slows down, stops and waits."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from aeros.apps.film.run_captions import RunCaptions
from aeros.apps.report_page.run_data import read_run_data
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path

RUN = Path(__file__).parent.parent / "data" / "run_with_a_person"


@cache
def sites() -> dict[str, Site]:
    """The reference site as it is now, under the digest that it had when the run was recorded."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return {str(one.site): site for one in read_run_data(RUN).decisions}


@cache
def captions() -> RunCaptions:
    """The captions of the run."""
    return RunCaptions(read_run_data(RUN), sites())
