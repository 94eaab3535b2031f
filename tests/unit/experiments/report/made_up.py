"""Results of an experiment made up by hand, in the form that `compute_results` has."""

from __future__ import annotations

from typing import Any


def cell(measured: float, exact: float | None = None, **more: Any) -> dict[str, Any]:
    """A cell with an interval of 10 to each side; a share if it has `hits`."""
    return {
        "measured": measured,
        "low": measured - 10.0,
        "high": measured + 10.0,
        "exact": exact,
        "independent": None,
        "paper": None,
        "misses": [],
        **more,
    }


def share(measured: float, exact: float | None = None, **more: Any) -> dict[str, Any]:
    return cell(measured, exact, hits=int(measured), of=100, **more)


def row(id_: str, cells: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "id": id_,
        "digest": f"digest of {id_}",
        "labels": ["flat pipeline", "table"],
        "variant": "flat",
        "task": "clean_table",
        "rate": "1/10",
        "at": "",
        "along": "",
        "trials": 100,
        "cells": cells,
        "drawn": None,
        "not_predicted": None,
        "series": {},
        "told": [],
        "raised": [],
        "why": [],
        "unexplained": [],
        "rerun": f"aeros experiment {id_} --plant symbolic",
        **more,
    }


def experiment(*rows: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "number": 4,
        "title": "made up",
        "note": "",
        "label": None,
        "metrics": {
            "success": {"title": "success", "share": True},
            "steps": {"title": "steps", "share": False},
        },
        "rows": list(rows),
        "means": [],
        "tests": [],
        "figure": "",
        "drawn": [],
        "timings": {},
        "overhead": [],
        **more,
    }


def results(*experiments: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "schema": "aeros/results/1",
        "plant": "symbolic",
        "trials": 100,
        "seeds": [0, 99],
        "premises": "p" * 8,
        "environment": {
            "commit": "abc",
            "python": "3.11.7",
            "platform": "Linux",
            "processors": 2,
            "packages": {"numpy": "2.0", "scipy": "1.1"},
        },
        "work": {"trials": 100, "sharing": 0, "plants": 0, "processor_s": 1800.0},
        "experiments": list(experiments),
        **more,
    }
