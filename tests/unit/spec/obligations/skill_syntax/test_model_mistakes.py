"""Calls of models: unknown and missing inputs, and outputs that a model never gives."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr.units import parse_unit
from aeros.spec.model.models import ModelValue, ModuleModel
from aeros.spec.obligations.skill_syntax.model_mistakes import model_mistakes
from aeros.spec.obligations.skill_syntax.skill_source import SkillFile
from tests.reports_in_full import compare_with_section, shown

SPAN = Source("ecm.yaml", "gauge").span(0, 5)


def value(name: str) -> ModelValue:
    unit = parse_unit("m")
    assert unit is not None
    return ModelValue(name, (), unit, (Fraction(0), Fraction(1)), SPAN)


GAUGE = ModuleModel(
    id="gauge",
    kind="table",
    file="gauge.csv",
    inputs={"level": value("level"), "tilt": value("tilt")},
    outputs={"volume": value("volume")},
    bounds=(),
    span=SPAN,
    file_span=SPAN,
)


def found(body: str) -> list[Diagnostic]:
    """Each mistake in a function with this body."""
    file = SkillFile("skills.py", f"def entry(observed, inputs, models):\n{body}".encode())
    return list(model_mistakes(file, file.functions["entry"], "models", {"gauge": GAUGE}))


REPORTS = Path(__file__).parents[1] / "data" / "model_mistakes.txt"
RUN = 'models["gauge"].run(level=1, tilt=2)'


@pytest.mark.parametrize(
    ("body", "headline", "marked"),
    [
        (
            '    models["gauge"].run(lvel=1, level=1, tilt=2)\n',
            "`lvel` is not an input of the model `gauge`",
            "lvel=1",
        ),
        (
            '    models["gauge"].run(level=1)\n',
            "the model `gauge` is not given its input `tilt`",
            'models["gauge"].run(level=1)',
        ),
        (
            '    models["gauge"].run()\n',
            "the model `gauge` is not given its input `level`",
            'models["gauge"].run()',
        ),
        (
            f'    return {RUN}["volum"]\n',
            "`volum` is not an output of the model `gauge`",
            '"volum"',
        ),
    ],
)
def test_a_mistake_is_marked(body: str, headline: str, marked: str) -> None:
    (mistake,) = found(body)
    assert mistake.primary is not None
    assert (mistake.headline, mistake.primary.span.text) == (headline, marked)
    compare_with_section(REPORTS, repr(body), "".join(f"{line}\n" for line in shown(mistake)))


@pytest.mark.parametrize(
    "body",
    [
        f'    return {RUN}["volume"]\n',
        '    models["gauge"].run(**inputs)\n',
        '    models["gauge"].run(level=1, **inputs)\n',
        "    models[inputs].run(lvel=1)\n",
        '    models["other"].run(lvel=1)\n',
        '    inputs["gauge"].run(lvel=1)\n',
        '    models = inputs\n    models["gauge"].run(lvel=1)\n',
        f'    found = {RUN}\n    found["volum"] = 2\n    return found["volum"]\n',
        f"    found = {RUN}\n    return found[inputs]\n",
    ],
)
def test_a_call_that_may_be_right_is_not_reported(body: str) -> None:
    assert found(body) == []
