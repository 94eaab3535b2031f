"""Generic graphs of steps, and walks over them.

Σ ::= step | Σ ; Σ | Σ ∥ Σ | if c then Σ else Σ | Σ or else Σ | again Σ | fail
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Generic, TypeAlias, TypeVar

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t

S = TypeVar("S")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Seq(Generic[S]):
    """Parts that run one after the other; it does nothing if empty.

    Attributes:
        parts: parts in the order in which they run.
    """

    parts: tuple[Part[S], ...]

    def __str__(self) -> str:
        return f"({' → '.join(map(str, self.parts))})" if self.parts else "nothing"


@dataclass(frozen=True, slots=True)
class Par(Generic[S]):
    """Parts that run at the same time. It fails with the first branch that fails for good.

    Attributes:
        branches: parts that start at the same time.
        span: place in the manifest.
    """

    branches: tuple[Part[S], ...]
    span: SourceSpan

    def __str__(self) -> str:
        return f"({' ∥ '.join(map(str, self.branches))})"


@dataclass(frozen=True, slots=True)
class If(Generic[S]):
    """Choice: `then` if the condition is measured as true, `otherwise` if as false; else it fails.

    Attributes:
        condition: the condition, on the state.
        text: its source text.
        then: part that runs if it is true.
        otherwise: None if the condition is claimed to be always true.
        span: place in the manifest.
    """

    condition: t.Term
    text: str
    then: Part[S]
    otherwise: Part[S] | None
    span: SourceSpan

    def __str__(self) -> str:
        otherwise = "" if self.otherwise is None else f" else {self.otherwise}"
        return f"(if {self.text} then {self.then}{otherwise})"


@dataclass(frozen=True, slots=True)
class Fallback(Generic[S]):
    """Alternatives: each runs only after the previous one has failed; the first that succeeds ends it.

    It fails if the last one does. A tolerated failure is a fallback to an empty `Seq`.

    Attributes:
        parts: the alternatives in the order in which they are tried.
        span: place in the manifest.
    """

    parts: tuple[Part[S], ...]
    span: SourceSpan

    def __str__(self) -> str:
        return f"({' or else '.join(map(str, self.parts))})"


@dataclass(frozen=True, slots=True)
class RetriedPart(Generic[S]):
    """Part that runs again from its beginning after it has failed, as long as tries are left.

    Attributes:
        part: the part.
        retry: number of further tries after a failure, at least 1.
        span: place in the manifest.
    """

    part: Part[S]
    retry: int
    span: SourceSpan

    def __str__(self) -> str:
        return f"({self.part}, at most {self.retry + 1} tries)"


@dataclass(frozen=True, slots=True)
class FailingPart:
    """Part that does nothing and fails.

    Attributes:
        text: source text of the condition that is not met.
        span: place in the manifest.
    """

    text: str
    span: SourceSpan

    def __str__(self) -> str:
        return "fail"


@dataclass(frozen=True, slots=True)
class NestedIf(If[S]):
    """Choice of another composition, which stands here as a whole.

    Attributes:
        is_precondition: it is the precondition of that composition.
    """

    is_precondition: bool = False


Part: TypeAlias = Seq[S] | Par[S] | If[S] | Fallback[S] | RetriedPart[S] | FailingPart | S


def walk_parts(part: Part[S]) -> Iterator[Part[S]]:
    """Yield a part and everything inside it.

    Args:
        part: graph.

    Yields:
        Each part before its own parts, in the order written.
    """
    yield part
    for inner in children_of(part):
        yield from walk_parts(inner)


def children_of(part: Part[S]) -> tuple[Part[S], ...]:
    """Return the direct parts of a part.

    Args:
        part: graph.

    Returns:
        Its parts, in the order written; none for a step.
    """
    match part:
        case Seq(parts=inner) | Par(branches=inner) | Fallback(parts=inner):
            return inner
        case If(then=then, otherwise=otherwise):
            return (then,) if otherwise is None else (then, otherwise)
        case RetriedPart(part=inner):
            return (inner,)
        case _:
            return ()


def steps_of(part: Part[S]) -> Iterator[S]:
    """Yield the steps of a graph.

    Args:
        part: graph.

    Yields:
        The steps, in the order written.
    """
    for inner in walk_parts(part):
        if not isinstance(inner, Seq | Par | If | Fallback | RetriedPart | FailingPart):
            yield inner


def map_graph_steps(part: Part[S], become: Callable[[S], R]) -> Part[R]:
    """Replace each step of a graph.

    Args:
        part: graph.
        become: function from a step to its replacement, called in the order written.

    Returns:
        A graph of the same shape.
    """
    match part:
        case Seq(parts=inner):
            return Seq(tuple(map_graph_steps(child, become) for child in inner))
        case Par(branches=inner, span=span):
            return Par(tuple(map_graph_steps(child, become) for child in inner), span)
        case Fallback(parts=inner, span=span):
            return Fallback(tuple(map_graph_steps(child, become) for child in inner), span)
        case RetriedPart(part=inner, retry=retry, span=span):
            return RetriedPart(map_graph_steps(inner, become), retry, span)
        case FailingPart():
            return part
        case If() as choice:
            other = None if choice.otherwise is None else map_graph_steps(choice.otherwise, become)
            then = map_graph_steps(choice.then, become)
            changed = If(choice.condition, choice.text, then, other, choice.span)
            return changed if not isinstance(choice, NestedIf) else _marked(changed, choice.is_precondition)
        case step:
            return become(step)


def as_nested(part: Part[S]) -> Part[S]:
    """Mark every choice of a graph as one of another composition, which stands here as a whole.

    Args:
        part: graph.

    Returns:
        A graph of the same shape.
    """
    return _map_choices(part, lambda one: _marked(one, isinstance(one, NestedIf) and one.is_precondition))


def without_marks(part: Part[S]) -> Part[S]:
    """Undo `as_nested`: whoever runs a graph need not know where its choices come from.

    Args:
        part: graph.

    Returns:
        A graph of the same shape.
    """
    return _map_choices(part, lambda one: If(one.condition, one.text, one.then, one.otherwise, one.span))


def _map_choices(part: Part[S], become: Callable[[If[S]], If[S]]) -> Part[S]:
    match part:
        case Seq(parts=inner):
            return Seq(tuple(_map_choices(one, become) for one in inner))
        case Par(branches=inner, span=span):
            return Par(tuple(_map_choices(one, become) for one in inner), span)
        case Fallback(parts=inner, span=span):
            return Fallback(tuple(_map_choices(one, become) for one in inner), span)
        case RetriedPart(part=inner, retry=retry, span=span):
            return RetriedPart(_map_choices(inner, become), retry, span)
        case If(then=then, otherwise=otherwise):
            other = None if otherwise is None else _map_choices(otherwise, become)
            return become(replace(part, then=_map_choices(then, become), otherwise=other))
        case _:
            return part


def _marked(choice: If[S], is_precondition: bool) -> NestedIf[S]:
    return NestedIf(
        choice.condition, choice.text, choice.then, choice.otherwise, choice.span, is_precondition
    )
