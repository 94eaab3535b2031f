"""A small site and a module with one skill, built by hand: these tests need no YAML and no solver."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.execution.governor import Governor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import GateMode
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.ecm import Ecm, Outcome, Skill
from aeros.spec.model.policy import Access, ModuleLimits, Quota
from aeros.spec.model.rules import ActionKind, Risk, Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.digests import code_digest, code_files
from tests.unit.runtime.one_step import Bench, MakeBench
from tests.unit.runtime.together import Asking, Cart, MakeCart

SPAN = Source("site.yaml", "text").span(0, 4)
METRES = RealType(LENGTH)
SIDES = EnumType("sides", ("left", "right"))
MakeEcm = Callable[..., Ecm]


def declare(name: str, type_: Type, role: t.VariableRole, **more: Any) -> Declared:
    return Declared(t.Variable(name, type_, role), SPAN, **more)


def _state(name: str, type_: Type, sensor: str) -> Declared:
    bounds = None if type_ is BOOL else (Fraction(-2), Fraction(20))
    return declare(name, type_, t.VariableRole.STATE, range=bounds, max_age=Fraction(1, 10), sensor=sensor)


@pytest.fixture
def site() -> Site:
    kinds = {
        name: ActionKind(name, frozenset({"arm"}), Risk.LOW, name == "stop", {}, SPAN)
        for name in ("move", "stop")
    }
    state = {
        "tool_position": _state("tool_position", VectorType(LENGTH), "encoders"),
        "human_distance": _state("human_distance", METRES, "scanner"),
        "holding": _state("holding", BOOL, "gripper"),
    }
    return Site(
        id="bench",
        digest="5" * 64,
        enums={},
        constants={},
        volumes={},
        state=state,
        kinds=kinds,
        rules=(
            Rule(
                id="separation",
                text="human_distance >= 1 m",
                rationale="",
                source="",
                terms={
                    "move": t.Compare("<=", t.Literal(Fraction(1), METRES), state["human_distance"].variable)
                },
                attenuations={},
                span=SPAN,
                require_span=SPAN,
            ),
        ),
        access=Access(),
        grants={},
        risk_ceiling=Risk.HIGH,
        limits=ModuleLimits(Fraction(100), 3, 3),
        blocks=(),
        quotas=(Quota("move-rate", frozenset({"move"}), 5, Fraction(60), SPAN),),
        resources={},
        span=SPAN,
    )


@pytest.fixture
def make_ecm(tmp_path: Path) -> MakeEcm:
    """Writes `skills.py` with this text and returns the module that certifies it."""

    def make(code: str, function: str = "lift") -> Ecm:
        folder = tmp_path / "handling"
        folder.mkdir(exist_ok=True)
        (folder / "skills.py").write_text(code)
        skill = Skill(
            id="lift",
            module_name="skills",
            function=function,
            inputs={
                "height": declare(
                    "inputs.height",
                    METRES,
                    t.VariableRole.INPUT,
                    range=(Fraction(0), Fraction(1, 10)),
                    default_value=Fraction(1, 10),
                ),
                "careful": declare("inputs.careful", BOOL, t.VariableRole.INPUT, default_value=True),
                "side": declare("inputs.side", SIDES, t.VariableRole.INPUT, default_value="left"),
            },
            precondition=None,
            outcomes={"lifted": Outcome("lifted", {"holding": True}, False, None, None)},
            envelope={},
            actuators=frozenset({"arm"}),
            resources=frozenset(),
            risk=Risk.LOW,
            timeout=Fraction(10),
            runtime_checked={},
            span=SPAN,
            entry_span=SPAN,
            risk_span=SPAN,
        )
        return Ecm(
            id="handling",
            version="1.0.0",
            folder=str(folder),
            manifest_digest="e" * 64,
            code_digest=code_digest(code_files(folder)),
            capabilities={},
            skills={"lift": skill},
            tasks={},
            requested_access=Access(sensors=frozenset({"encoders", "gripper"})),
            permitted_actions={},
            required_modules={},
            requires_spans={},
            required_aeros_version=">=0.1",
            runtime_span=SPAN,
            access_span=SPAN,
            span=SPAN,
        )

    return make


@pytest.fixture
def make_bench(site: Site, make_ecm: Any, tmp_path: Path) -> Iterator[MakeBench]:
    made: list[Bench] = []

    def make(body: Callable[..., Any] | None = None, code: str = "") -> Bench:
        bench = Bench(site, make_ecm(code), tmp_path / "audit.jsonl", body)
        made.append(bench)
        return bench

    yield make
    for bench in made:
        bench.audit.close()


@pytest.fixture
def cart(tmp_path: Path) -> Iterator[MakeCart]:
    made: list[Cart] = []

    def make(
        mode: GateMode = GateMode.COMPILED,
        governor: Governor | None = None,
        under: Configuration | None = None,
        **bodies: Asking,
    ) -> Cart:
        log = tmp_path / f"audit-{len(made)}.jsonl"
        made.append(Cart(log, bodies, mode, governor, under=under))
        return made[-1]

    yield make
    for one in made:
        one.audit.close()
