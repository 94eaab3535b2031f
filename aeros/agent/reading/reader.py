"""Reader of instructions that asks a language model and checks every answer before use.

The model receives the words of the instruction and the vocabulary as data, before anything moves. Its answer
has to be JSON of a strict form (`answer.py`), its account for the words has to be right (`word_claims.py`),
and its goals and plans have to pass the checks of `formal_meaning.py`. Problems are reported to the model,
for a bounded number of tries in a bounded time.

A checked reading is still only a proposal. It counts if it agrees with the grammar's meaning
(`agreement.py`), or if an operator confirms it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.llm_client import LlmEndpoint, LlmError, request_completion
from aeros.agent.reading.agreement import meanings_agree
from aeros.agent.reading.answer import MalformedAnswerError, ModelAnswer, parse_answer
from aeros.agent.reading.formal_meaning import FormalMeaning, StartState, UnacceptableAnswerError
from aeros.agent.reading.prompt import SYSTEM_PROMPT, answer_form, describe_instruction, instruction_domain
from aeros.agent.reading.word_claims import COURTESY, ORDER, WordClaim, check_claims
from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site

MAX_TRIES: Final = 3
"""Largest number of requests to the model for one instruction."""

_RETRY_DELAY_S: Final = 0.5  # s, before a server that is busy is asked again
_MAX_FEEDBACK_CHARS: Final = 4000
_MAX_REASON_CHARS: Final = 600


class RejectedReadingError(InstructionError):
    """An instruction that no language model read acceptably, or that the grammar reads differently."""


@dataclass(frozen=True, slots=True)
class ModelReading:
    """Checked reading of an instruction by a language model.

    Attributes:
        model: name of the model.
        meaning: its meaning.
        claims: part of the answer that each phrase accounts for.
        unaccounted: words that nothing accounts for.
    """

    model: str
    meaning: Understanding
    claims: tuple[WordClaim, ...]
    unaccounted: Words

    @property
    def lines(self) -> tuple[str, ...]:
        """Formal text of the meaning, then the words that ask for nothing, then those without account."""
        idle = [" ".join(claim.words) for claim in self.claims if claim.part in (COURTESY, ORDER)]
        notes = [("asks for nothing", idle), ("not accounted for", list(self.unaccounted))]
        return self.meaning.formal_lines + tuple(
            f"{label}: {', '.join(map(quoted, phrases))}" for label, phrases in notes if phrases
        )


class LlmReader:
    """Reader of instructions for one site and its active modules.

    Args:
        site: the site.
        modules: active modules by id.
        endpoint: address of the model.
        timeout_s: wall time (s) for all tries at one instruction.
        start: values at the declared start of a task.
    """

    def __init__(
        self,
        site: Site,
        modules: Mapping[str, Ecm],
        endpoint: LlmEndpoint,
        timeout_s: float,
        start: StartState,
    ) -> None:
        self._site = site
        self._modules = modules
        self._endpoint = endpoint
        self._within = timeout_s
        self._start = start
        self._oracle = Oracle()
        self._formal = FormalMeaning(site, modules, start, self._oracle)
        self._nouns = frozenset(noun for entry in task_phrases(modules) for noun in entry.objects)

    def read(self, instruction: str) -> ModelReading:
        """Ask the model for the meaning of an instruction.

        Args:
            instruction: words of the user.

        Returns:
            The first answer that passes all checks, or else the last that only leaves words unaccounted.

        Raises:
            RejectedReadingError: no answer passes the checks.
        """
        by = time.monotonic() + self._within
        domain = instruction_domain(self._site, self._modules, self._start, self._oracle)
        question = describe_instruction(instruction, domain, self._site, self._modules, self._start)
        schema = answer_form(domain, self._modules, self._site.limits.retries)
        messages = [
            {"role": "system", "content": SYSTEM_PROMPT},
            {"role": "user", "content": json.dumps(question)},
        ]
        rejections: list[str] = []
        incomplete: ModelReading | None = None
        while len(rejections) < MAX_TRIES:
            try:
                text = request_completion(self._endpoint, messages, schema, by)
            except LlmError as error:
                rejections.append(str(error))
                if not error.may_pass:
                    break
                time.sleep(max(0.0, min(_RETRY_DELAY_S, by - time.monotonic())))
                continue
            found = self._check(instruction, text)
            if isinstance(found, ModelReading):
                if not found.unaccounted:
                    return found
                incomplete = found
                found = f"no part accounts for {', '.join(map(quoted, found.unaccounted))}"
            rejections.append(found)
            messages += _feedback(text, found)
        if incomplete is not None:
            return incomplete
        reasons = (one[:_MAX_REASON_CHARS] for one in rejections)
        tries = "; ".join(f"try {number}: {one}" for number, one in enumerate(reasons, 1))
        raise RejectedReadingError(
            f"the language model `{self._endpoint.model}` gave no reading of {quoted(instruction)} that "
            f"passes the checks, so nothing moves: {tries}"
        )

    def agree(self, grammar: Understanding, reading: ModelReading) -> Understanding:
        """Compare a reading with the grammar's meaning.

        Args:
            grammar: meaning by the grammar.
            reading: reading of the same instruction.

        Returns:
            The grammar's meaning, with the plans of the model.

        Raises:
            RejectedReadingError: they do not agree; the message shows both.
        """
        if not meanings_agree(grammar, reading.meaning, self._site, self._oracle):
            raise RejectedReadingError(
                f"grammar and language model read {quoted(grammar.instruction)} differently, so nothing "
                f"moves: the grammar as {'; '.join(grammar.formal_lines)}; `{reading.model}` as "
                f"{'; '.join(reading.lines)}"
            )
        pairs = zip(grammar.errands, reading.meaning.errands, strict=True)
        errands = tuple(replace(one, proposed_plan=other.proposed_plan) for one, other in pairs)
        source = f"grammar, and `{reading.model}` agrees"
        return replace(grammar, errands=errands, source=source, account=_account(reading))

    def confirmed(self, reading: ModelReading, operator: str) -> Understanding:
        """Return the meaning of a reading that an operator has confirmed.

        Args:
            reading: the reading.
            operator: description of the operator, for the audit record.

        Returns:
            The meaning, with its source.
        """
        source = f"`{reading.model}`, confirmed by {operator}"
        return replace(reading.meaning, source=source, account=_account(reading))

    def _check(self, instruction: str, text: str) -> ModelReading | str:
        """Return the reading that an answer holds, or the reason to reject it."""
        try:
            answer = parse_answer(text)
            meaning = self._formal.meaning_of(instruction, answer)
        except (MalformedAnswerError, UnacceptableAnswerError) as error:
            return escape_invisible(str(error))
        account = check_claims(instruction, answer.claims, _parts(answer), self._nouns)
        if account.problems:
            return escape_invisible("; ".join(account.problems))
        return ModelReading(self._endpoint.model, meaning, answer.claims, account.unaccounted)


def _parts(answer: ModelAnswer) -> dict[str, str]:
    """Formal text of each part of an answer that some word must account for."""
    parts = {
        f"request {number}": f"{one.goal} {dict(one.arguments)}"
        for number, one in enumerate(answer.requests, 1)
    }
    parts |= {
        f"condition {number}": one.condition
        for number, one in enumerate(answer.requests, 1)
        if one.condition is not None
    }
    return parts | {f"prohibition {number}": name for number, name in enumerate(answer.prohibited, 1)}


def _account(reading: ModelReading) -> tuple[str, ...]:
    """Lines for the audit record: each phrase with its part, and the words without account."""
    lines = [f"{quoted(' '.join(claim.words))}: {claim.part}" for claim in reading.claims]
    return (*lines, *(f"{quoted(word)}: not accounted for" for word in reading.unaccounted))


def _feedback(answer: str, problem: str) -> list[dict[str, Any]]:
    reason = json.dumps({"rejected_because": problem[:_MAX_FEEDBACK_CHARS]})
    return [
        {"role": "assistant", "content": answer[:_MAX_FEEDBACK_CHARS]},
        {"role": "user", "content": reason},
    ]
