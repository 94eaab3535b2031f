"""`aeros decide`: decide action requests: one request per line of JSON in, one decision per line out."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, BinaryIO

from aeros.cli.arguments import add_command, existing_path
from aeros.cli.author.example_requests import example_requests
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.run.decision_text import decision_text, explanation_text
from aeros.cli.terminal.streams import output_width, print_data
from aeros.exit_codes import Exit
from aeros.runtime.gate.explain import Explainer
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.gate.wire import MAX_LINE, decide_line, decision_json, explain_line, explanation_json
from aeros.runtime.proving import prove_configuration
from aeros.spec.backends.answer_store import open_default_store
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.verify import verify

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
The module is proved first; if the proof fails, nothing is decided and the exit code is 1.  Each line is
decided on its own: it contains the state, the time and the use of quotas.  State that no rule on the
action reads may be absent or old; values that are present must be well-formed.  Denials do not change the
exit code, which is 0 once every line has its decision.

--explain lists for each decision the layers that it passed, the rules that were proved at installation
(with the obligations of the certificate), and the runtime-checked rules with results and values.

a request:
  {"time": 10.0,
   "action": {"kind": "grip", "parameters": {"width": 0.04, "force": 8}},
   "state": {"human_distance": {"value": 3.2, "time": 9.98}, ...},
   "inputs": {}, "usage": {"grip-rate": 0}}

examples:
  aeros decide --ecm ecms/make_dumplings --skill wrap --print-examples > requests.jsonl
  aeros decide --ecm ecms/make_dumplings --skill wrap < requests.jsonl
  aeros decide --ecm ecms/make_dumplings --skill wrap --explain < requests.jsonl
  aeros decide --ecm ecms/make_dumplings --skill wrap --explain --format json < requests.jsonl
  aeros decide --site cell.yaml --ecm my_module --skill pick --gate z3 < requests.jsonl
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "decide", __doc__, _EXAMPLES)
    parser.add_argument(
        "--site", type=existing_path, help="the site file (default: the reference site, a Panda cell)"
    )
    parser.add_argument("--ecm", type=existing_path, required=True, help="module of the requesting skill")
    parser.add_argument("--skill", required=True, help="the requesting skill")
    parser.add_argument(
        "--gate",
        choices=[mode.value for mode in GateMode],
        default=GateMode.COMPILED.value,
        help="how conditions are decided; checked asks both and halts on a disagreement (default: compiled)",
    )
    parser.add_argument("--explain", action="store_true", help="explain each decision")
    parser.add_argument(
        "--format",
        choices=["json", "text"],
        help="json: one object per line; text: for people (default: json, with --explain text)",
    )
    parser.add_argument(
        "--print-examples",
        action="store_true",
        help="print example requests that are allowed, and decide nothing",
    )
    add_module_settings(parser)
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    site = arguments.site or reference_site_path()
    settings = OperatorSettings(configurations=module_configurations(arguments))
    configuration, _ = prove_configuration([arguments.ecm], site, certified=False, settings=settings)
    if len(configuration.modules) != 1:
        print(f"aeros: `{arguments.ecm}` holds several modules; name one", file=sys.stderr)
        return Exit.USAGE
    (ecm,) = configuration.modules.values()
    if arguments.skill not in ecm.skills:
        known = ", ".join(ecm.skills)
        print(f"aeros: `{ecm.id}` has no skill `{arguments.skill}`; it has {known}", file=sys.stderr)
        return Exit.USAGE
    explainer = Explainer(configuration, GateMode(arguments.gate))
    if arguments.print_examples:
        with open_default_store() as store:
            in_full = verify([arguments.ecm], site, store=store, settings=settings)
        for request in example_requests(
            explainer.gate, configuration.site, ecm, ecm.skills[arguments.skill], in_full
        ):
            print_data(request)
        return Exit.SUCCESS
    is_text = (arguments.format or ("text" if arguments.explain else "json")) == "text"
    for line in _lines(sys.stdin.buffer):
        if arguments.explain:
            explanation = explain_line(explainer, ecm.id, arguments.skill, line)
            shown = (
                explanation_text(explanation, output_width())
                if is_text
                else json.dumps(explanation_json(explanation))
            )
        else:
            decision = decide_line(explainer.gate, ecm.id, arguments.skill, line)
            shown = decision_text(decision) if is_text else json.dumps(decision_json(decision))
        if is_text:
            print(shown, flush=True)
        else:
            print_data(shown, flush=True)
    return Exit.SUCCESS


def _lines(stream: BinaryIO) -> Iterator[bytes]:
    """Yield each line; of a line beyond the limit only enough to show that it is too long."""
    while line := stream.readline(MAX_LINE + 2):
        rest = line
        while rest and not rest.endswith(b"\n"):
            rest = stream.readline(MAX_LINE)
        yield line.rstrip(b"\r\n") if len(line) <= MAX_LINE + 1 else line
