"""The gate's finite layers as they ship, explored: any site, module, skill, kind, caller and usage.

`finite_objections` is run with its parts put aside, and each part is explored by itself.  Two overrides,
two quotas and two actuators stand for any number: the code treats each by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.gate.decision import Reason
from aeros.spec.theorems.module_copies import Code, put_in_place
from aeros.spec.theorems.smtlib import conjunction, disjunction, literal, negation
from aeros.spec.theorems.symbolic_execution import Ask, Diagram, Symbol, explore
from aeros.spec.theorems.theorem import Obligation, Table

LAYERS: Final = "aeros.runtime.gate.finite_layers"
MODEL: Final = "aeros.spec.model.model"

_BLOCKS: Final = ("block.1", "block.2")
_QUOTAS: Final = ("quota.1", "quota.2")
_ACTUATORS: Final = ("arm", "hand")
_FIELDS: Final = ("module", "skill", "kind")


def _constants(sort: str, names: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"(declare-const {name} {sort})" for name in names)


def layer_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Each layer objects exactly where it is there to; together they pass exactly where each does."""
    return {
        "finite-layers": _together,
        "override": _override,
        "access": _access,
        "risk": _risk,
        "counts": _counts,
        "quota": _quota,
    }


# All of them.

TOGETHER: Final = (
    *_constants("Bool", ("kind-known", "module-active", "skill-exists")),
    *_constants("Bool", (f"{block}.matches" for block in _BLOCKS)),
    *_constants("Bool", ("accessible", "risk-borne", "counts-formed")),
    *_constants("Bool", (f"{quota}.{what}" for quota in _QUOTAS for what in ("governs", "left"))),
    "(define-fun unblocked () Bool (not (or block.1.matches block.2.matches)))",
    "(define-fun dispatchable () Bool (and kind-known module-active skill-exists))",
    "(define-fun quotas-left () Bool"
    " (and (=> quota.1.governs quota.1.left) (=> quota.2.governs quota.2.left)))",
    "(define-fun every-layer () Bool"
    " (and unblocked dispatchable accessible risk-borne counts-formed quotas-left))",
)
"""What each layer comes to, and all of them."""


@dataclass(frozen=True)
class Site:
    """The overrides and quotas that a site has."""

    blocks: tuple[str, ...] = _BLOCKS
    quotas: tuple[str, ...] = _QUOTAS


_WHOLE: Final = Site()


def explore_together(code: Code, result: Callable[[list[Reason]], str], with_: Site = _WHOLE) -> Diagram:
    """What `finite_objections` yields under such a site, of which `result` makes a term."""
    layers = code.module(LAYERS)

    def run(ask: Ask) -> str:
        def part(question: str, told: str) -> Callable[..., Iterator[Reason]]:
            return lambda *_: iter(() if ask(question) else (Reason(told, "", ""),))

        def quota_objections(quota: Any, _: Any) -> Iterator[Reason]:
            if not ask(f"{quota.id}.left"):
                yield Reason("AE742", quota.id, "")

        put_in_place(
            layers,
            {
                "_access_objections": part("accessible", "AE740"),
                "_risk_objections": part("risk-borne", "AE741"),
                "_usage_objections": part("counts-formed", "AE704"),
                "_quota_objections": quota_objections,
            },
        )
        site = SimpleNamespace(
            kinds=_Known(ask, "kind-known", "kind"),
            blocks=[
                SimpleNamespace(id=one, reason="", matches=lambda *_, one=one: ask(f"{one}.matches"))
                for one in with_.blocks
            ],
            quotas=[SimpleNamespace(id=one, kinds=_Member(ask, f"{one}.governs")) for one in with_.quotas],
        )
        ecm = SimpleNamespace(skills=_Known(ask, "skill-exists", "skill"))
        configuration = SimpleNamespace(site=site, modules=_Known(ask, "module-active", ecm))
        caller = SimpleNamespace(module="m", skill="k")
        return result(list(layers.finite_objections(configuration, caller, "a", {})))

    return explore(run)


class _Known:
    """A mapping that has what is asked for, or has not."""

    def __init__(self, ask: Ask, question: str, value: Any) -> None:
        self._ask, self._question, self._value = ask, question, value

    def get(self, _: Any) -> Any:
        return self._value if self._ask(self._question) else None


class _Member:
    """A set that has what is asked for, or has not."""

    def __init__(self, ask: Ask, question: str) -> None:
        self._ask, self._question = ask, question

    def __contains__(self, _: Any) -> bool:
        return self._ask(self._question)


def passing(found: Iterable[Reason]) -> str:
    """Whether there is no objection, as a term."""
    return literal(not list(found))


def telling(code: str) -> Callable[[list[Reason]], str]:
    """Whether there is an objection of this code, as a term."""
    return lambda found: literal(any(one.code == code for one in found))


def _together(code: Code) -> Obligation:
    # Where there is no such module, skill or kind, nobody asks what it may touch.
    return Obligation(
        "`finite_objections` yields nothing exactly where every finite layer passes.",
        TOGETHER,
        "(= nothing every-layer)",
        tables=(Table("nothing", "Bool", explore_together(code, passing)),),
    )


# Overrides.


def _override(code: Code) -> Obligation:
    model = code.module(MODEL)

    def run(ask: Ask) -> str:
        def given(name: str) -> Any:
            return None if ask(f"any-{name}") else Symbol(f"blocked-{name}", ask)

        block = model.Block("block", "", *(given(name) for name in _FIELDS))
        asking = (Symbol(f"asking-{name}", ask) for name in _FIELDS)
        return str(bool(block.matches(*asking))).lower()

    matched = conjunction(f"(or any-{name} (= blocked-{name} asking-{name}))" for name in _FIELDS)
    return Obligation(
        "`Block.matches` exactly where every field that the operator gave is that of who asks, and what for.",
        (
            "(declare-sort Name 0)",
            *_constants("Bool", (f"any-{name}" for name in _FIELDS)),
            *_constants("Name", (f"{whose}-{name}" for name in _FIELDS for whose in ("blocked", "asking"))),
        ),
        f"(= matches {matched})",
        tables=(Table("matches", "Bool", explore(run)),),
    )


# Access.


class _Set:
    """A set of actuators: for each, the formula that says whether it is in."""

    def __init__(self, ask: Ask, members: Mapping[str, str]) -> None:
        self._ask, self._members = ask, members

    @classmethod
    def of(cls, ask: Ask, whose: str) -> _Set:
        return cls(ask, {one: f"{whose}.{one}" for one in _ACTUATORS})

    def _with(self, other: _Set | frozenset[str], of_both: Callable[[str, str], str]) -> _Set:
        theirs = (
            other._members if isinstance(other, _Set) else {x: literal(x in other) for x in self._members}
        )
        return _Set(self._ask, {x: of_both(mine, theirs[x]) for x, mine in self._members.items()})

    def __and__(self, other: _Set | frozenset[str]) -> _Set:
        return self._with(other, lambda mine, theirs: conjunction([mine, theirs]))

    def __or__(self, other: _Set | frozenset[str]) -> _Set:
        return self._with(other, lambda mine, theirs: disjunction([mine, theirs]))

    def __sub__(self, other: _Set | frozenset[str]) -> _Set:
        return self._with(other, lambda mine, theirs: conjunction([mine, negation(theirs)]))

    def __iter__(self) -> Iterator[str]:
        return (one for one, formula in self._members.items() if self._ask(formula))


def _access(code: Code) -> Obligation:
    layers, model = code.module(LAYERS), code.module(MODEL)

    def run(ask: Ask) -> str:
        class Grants:
            def get(self, _: str, default: Any) -> Any:
                return model.Access(_Set.of(ask, "grant")) if ask("granted") else default

        site = SimpleNamespace(access=model.Access(_Set.of(ask, "site")), grants=Grants())
        site.access_of = lambda module: model.Site.access_of(site, module)
        ecm = SimpleNamespace(id="m", access=model.Access(_Set.of(ask, "module")))
        skill = SimpleNamespace(id="k", actuators=_Set.of(ask, "skill"))
        kind = SimpleNamespace(actuators=_Set.of(ask, "kind"))
        return passing(layers._access_objections(site, ecm, skill, kind))

    usable = conjunction(
        f"(=> kind.{one} (and skill.{one} module.{one} (or site.{one} (and granted grant.{one}))))"
        for one in _ACTUATORS
    )
    return Obligation(
        "`_access_objections` yields nothing exactly where each actuator of the kind is the skill's, the\n"
        "module's, and the site's for everybody or granted to the module.",
        _constants(
            "Bool",
            (
                "granted",
                *(f"{w}.{one}" for one in _ACTUATORS for w in ("kind", "skill", "module", "site", "grant")),
            ),
        ),
        f"(= nothing {usable})",
        tables=(Table("nothing", "Bool", explore(run)),),
    )


# Risk.


def _risk(code: Code) -> Obligation:
    layers = code.module(LAYERS)

    def run(ask: Ask) -> str:
        kind = SimpleNamespace(name="a", risk=Symbol("kind.risk", ask))
        skill = SimpleNamespace(id="k", risk=Symbol("skill.risk", ask))
        site = SimpleNamespace(risk_ceiling=Symbol("site.risk", ask))
        return passing(layers._risk_objections(site, skill, kind))

    return Obligation(
        "`_risk_objections` yields nothing exactly where the skill declares the risk of the kind, and the\n"
        "site bears that of the skill.",
        _constants("Int", ("kind.risk", "skill.risk", "site.risk")),
        "(= nothing (and (<= kind.risk skill.risk) (<= skill.risk site.risk)))",
        tables=(Table("nothing", "Bool", explore(run)),),
    )


# Quotas, and what is said of their use.

_USE: Final = (
    *_constants("Bool", (f"{quota}.{what}" for quota in _QUOTAS for what in ("told", "whole"))),
    *_constants("Int", (f"{quota}.{what}" for quota in _QUOTAS for what in ("used", "at-most"))),
    "(declare-const stranger-told Bool)",
)


class _Usage:
    """How much of each quota is used up, as whoever asks says."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    def get(self, quota: str) -> Any:
        return Symbol(f"{quota}.used", self._ask) if self._ask(f"{quota}.told") else None

    def items(self) -> Iterator[tuple[str, Any]]:
        yield from ((one, Symbol(f"{one}.used", self._ask)) for one in _QUOTAS if self._ask(f"{one}.told"))
        if self._ask("stranger-told"):
            yield "stranger", 0


def _type_of(value: Any) -> type:
    """What kind of number the use of a quota is said to be, if it is one."""
    if not isinstance(value, Symbol):
        return type(value)
    return int if value.ask(f"{value.term.removesuffix('.used')}.whole") else str


def _counts(code: Code) -> Obligation:
    layers = code.module(LAYERS, type=_type_of)

    def run(ask: Ask) -> str:
        site = SimpleNamespace(quotas=[SimpleNamespace(id=quota) for quota in _QUOTAS])
        return passing(layers._usage_objections(site, _Usage(ask)))

    formed = conjunction(
        ["(not stranger-told)", *(f"(=> {q}.told (and {q}.whole (>= {q}.used 0)))" for q in _QUOTAS)]
    )
    return Obligation(
        "`_usage_objections` yields nothing exactly where all that is said of use is a count of a quota of\n"
        "the site.",
        _USE,
        f"(= nothing {formed})",
        tables=(Table("nothing", "Bool", explore(run)),),
    )


def _quota(code: Code) -> Obligation:
    layers = code.module(LAYERS, type=_type_of)

    def run(ask: Ask) -> str:
        quota = SimpleNamespace(id="quota.1", at_most=Symbol("quota.1.at-most", ask))
        return passing(layers._quota_objections(quota, _Usage(ask)))

    return Obligation(
        "`_quota_objections` yields nothing exactly where less of it is used than there is; of what is no\n"
        "count, `_usage_objections` has objected.",
        _USE,
        "(=> (=> quota.1.told (and quota.1.whole (>= quota.1.used 0)))"
        " (= nothing (and quota.1.told (< quota.1.used quota.1.at-most))))",
        tables=(Table("nothing", "Bool", explore(run)),),
    )
