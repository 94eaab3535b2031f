"""`aeros why`: explain why a run failed, a step was denied, a plan was rejected or the robot stopped."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aeros.apps.why.causal_chain import CausalExplanation, RunLog, StepTrace
from aeros.cli.arguments import add_command
from aeros.cli.latest_run import add_run_argument, find_audit_log
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, UsageError
from aeros.runtime.audit.check import Record, verify_log
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.cause import Cause, causes_to_json

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
Reads only the audit log.  Prints a chain from the end back to the measured values, with each rule, the
place where it is written, and the values that would have to differ.  Exits with 1 if the log is not sound.

examples:
  aeros why                           the newest run in `runs`
  aeros why runs/demo                 a run by its folder, or by its audit.jsonl
  aeros why runs/demo --step 3        why the third step ended as it did
  aeros why runs/demo --format json   for programs
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "why", __doc__, _EXAMPLES)
    add_run_argument(parser, "run")
    parser.add_argument("--step", type=int, metavar="N", help="explain the N-th step, not the end of the run")
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    log = find_audit_log(arguments.run)
    records: list[Record] = []
    chain = verify_log(log, lambda record, own: records.append(record))
    if not chain.is_sound:
        print(f"aeros: cannot explain: the audit log is not sound: {chain.reason}", file=sys.stderr)
        return Exit.REJECTED
    run = RunLog(records)
    why = run.explain_end() if arguments.step is None else run.explain_step(_check_step(run, arguments.step))
    if arguments.format == "json":
        print_data(_as_json(log, why))
    else:
        print("\n".join(map(escape_invisible, _lines(why))))
    return Exit.SUCCESS


def _check_step(run: RunLog, number: int) -> StepTrace:
    if not 1 <= number <= len(run.steps):
        raise UsageError(f"no step {number}; the run has {len(run.steps)} steps")
    return run.steps[number - 1]


def _lines(why: CausalExplanation) -> Iterator[str]:
    yield why.headline
    for link in why.chain:
        yield f"  because   {link.text}  (record {link.record})"
        for cause in link.causes:
            yield from (f"            {line}" for line in _cause(cause))
    for line in why.changes:
        yield f"  to change {line}"
    for link in why.broken_assumptions:
        yield f"  broken    {link.text}  (record {link.record})"
    for link in why.stops:
        yield f"  stop      {link.text}  (record {link.record})"
    for (skill, reason), each in groupby(why.failed, lambda step: (step.skill, step.reason)):
        first, *others = [step.number for step in each]
        steps = f"steps {first} to {others[-1]}" if others else f"step {first}"
        yield f"  failed    {steps}, {skill}: {reason}"


def _cause(cause: Cause) -> Iterator[str]:
    yield str(cause)
    written = ", ".join(filter(None, (cause.source, cause.location)))
    if written:
        yield f"   {cause.kind} `{cause.text}`; {written}"


def _as_json(log: Path, why: CausalExplanation) -> str:
    chain, broken, stops = (
        [{"record": link.record, "said": link.text, "causes": causes_to_json(link.causes)} for link in links]
        for links in (why.chain, why.broken_assumptions, why.stops)
    )
    failed = [_step_json(step) for step in why.failed]
    answer: dict[str, Any] = {
        "log": str(log),
        "headline": why.headline,
        "chain": chain,
        "changes": why.changes,
        "broken": broken,
        "stops": stops,
        "failed": failed,
    }
    return json.dumps(answer, indent=2)


def _step_json(step: StepTrace) -> dict[str, Any]:
    return {
        "number": step.number,
        "skill": step.skill,
        "begin": step.start_index,
        "end": step.end_index,
        "failed": step.failed,
        "reason": step.reason,
    }
