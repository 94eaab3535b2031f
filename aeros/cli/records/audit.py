"""`aeros audit`: verify, show and replay the audit log of a run."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.cli.arguments import (
    add_command,
    add_module_folders,
    add_signature_check,
    existing_path,
    writable_path,
)
from aeros.cli.help_text import WrappedEpilog
from aeros.cli.latest_run import add_run_argument, find_audit_log
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.records.show import add_filters, explain_record, format_record, matches_filters
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import EXIT_CODES, Exit
from aeros.runtime.audit.check import CHECKPOINT, AuditReport, Record, RecordCheck, verify_log
from aeros.runtime.audit.checkpoints import AnchorError, SignatureReport, verify_signed
from aeros.runtime.audit.format import explain_problem
from aeros.runtime.audit.keys import PUBLIC_SUFFIX, InvalidKeyError, make_key, read_public_key
from aeros.runtime.gate.configuration import FindConfiguration
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.records.replay import LogReplay, ReplayMismatch
from aeros.runtime.registry.change_log import LOG, anchor_of
from aeros.runtime.registry.folder_modules import default_modules, uses_installed_modules
from aeros.runtime.registry.past_configurations import FolderConfigurations, PastConfigurations
from aeros.runtime.registry.registry import Registry
from aeros.session.setup import KEY, default_anchor
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
A run writes its audit log to audit.jsonl, signed with the key of the agent, and keeps the newest signature
in a second file, the anchor, in the agent's folder.  `aeros run --anchor` keeps it in further files;
docs/audit.md lists the tampering that each of them detects.

examples:
  aeros audit verify --state .aeros               the newest run in `runs`
  aeros audit verify runs/demo --public-key audit.key.pub --anchor /mnt/other/demo.anchor
  aeros audit show runs/demo --decision DENY
  aeros audit replay runs/demo
"""
_VERIFY_EXAMPLES = """\
Exits with 0 if the log is sound as far as it was checked, else with 1.

without options   detects edited, deleted, inserted, moved and torn records; not a cut tail, nor a log
                  whose hashes were all recomputed
--public-key      detects these too, up to the newest checkpoint; not a log cut off right after an earlier
                  checkpoint, nor one replaced by another that the same key signed
--anchor          detects these too, up to the checkpoint in the anchor; not if log and anchor were put back
                  together, unless another --anchor was not
--state           checks with the key and the anchor in the agent's folder
--closed          rejects a log with an unsigned end: its writer is at work, or was killed

examples:
  aeros audit verify runs/demo
  aeros audit verify --state .aeros --closed      the newest run in `runs`
  aeros audit verify runs/demo --public-key audit.key.pub --anchor /mnt/other/demo.anchor
"""
_SHOW_EXAMPLES = """\
Each decision other than a plain ALLOW is followed by its reasons.  With --site they include the place and
source of the rule, and the values that it read.

examples:
  aeros audit show runs/demo --decision DENY --site cell.yaml      why was this denied?
  aeros audit show runs/demo --skill make_dumplings.boil --rule separation
  aeros audit show runs/demo --event step-ended --format json
"""
_REPLAY_EXAMPLES = """\
The configuration is loaded and proved again, and must have the digest in the log.  The registry in the
agent's folder keeps all earlier configurations of the robot, so a log is replayed across changes.  Replay a
run with --site or --ecms with the same options.  Exits with 0 if every decision is reproduced, else
with 1.

examples:
  aeros audit replay runs/demo
  aeros audit replay runs/demo --state /srv/robot7
  aeros audit replay runs/demo --site cell.yaml --ecms ecms --gate checked
"""
_KEYGEN_EXAMPLES = """\
Writes the private key to FILE, readable only by its owner, and the public key to FILE.pub.  Keep the
public key where no process that writes the log can write. Anyone who can replace the key can forge a log.

examples:
  aeros audit keygen --out .aeros/audit.key      where `aeros run` looks for it
  aeros audit keygen --out /secure/cell7.key
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "audit", __doc__, _EXAMPLES)
    own = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    verify = _add(
        own, "verify", "check that the audit log is complete and untampered", _VERIFY_EXAMPLES, _verify
    )
    add_signature_check(verify)
    verify.add_argument(
        "--state", type=existing_path, help="check with the key and the anchor in this agent's folder"
    )
    verify.add_argument(
        "--closed", action="store_true", help="reject a log whose end is not signed by a closing checkpoint"
    )

    show = _add(own, "show", "show records, and why actions were denied", _SHOW_EXAMPLES, _show)
    show.add_argument("--site", type=existing_path, help="the site file of the run, to show its rules")
    add_filters(show)

    replay = _add(own, "replay", "re-decide every recorded action", _REPLAY_EXAMPLES, _replay)
    replay.add_argument(
        "--site",
        type=existing_path,
        help="the site file (default: those in force on this robot, or else the reference site)",
    )
    add_module_folders(replay, "the modules (default: those active on this robot, or else `ecms`)")
    add_module_settings(replay)
    replay.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    replay.add_argument(
        "--gate",
        choices=[mode.value for mode in GateMode],
        default=GateMode.COMPILED.value,
        help="how conditions are decided (default: compiled)",
    )

    keygen = _add(own, "keygen", "make a key to sign with", _KEYGEN_EXAMPLES, _keygen, reads_log=False)
    keygen.add_argument("--out", type=writable_path, required=True, metavar="FILE", help="the private key")


def _add(
    own: Subparsers,
    name: str,
    summary: str,
    examples: str,
    command: Callable[[argparse.Namespace], Exit],
    *,
    reads_log: bool = True,
) -> argparse.ArgumentParser:
    parser = own.add_parser(
        name,
        help=summary,
        description=f"`aeros audit {name}`: {summary}.",
        epilog=f"{examples}\n{EXIT_CODES}",
        formatter_class=WrappedEpilog,
    )
    if reads_log:
        add_run_argument(parser, "log")
        parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
        parser.set_defaults(command=lambda arguments: command(_with_log(arguments)))
    else:
        parser.set_defaults(command=command)
    return parser


def _with_log(arguments: argparse.Namespace) -> argparse.Namespace:
    """Let `log` be the audit log itself where a folder is given, or nothing."""
    arguments.log = find_audit_log(arguments.log)
    return arguments


# verify


def _verify(arguments: argparse.Namespace) -> Exit:
    key, anchors = arguments.public_key, list(arguments.anchor)
    if arguments.state is not None:
        key = key or arguments.state / f"{KEY}{PUBLIC_SUFFIX}"
        anchors.append(_own_anchor(arguments.state, arguments.log))
    if key is None and (anchors or arguments.closed):
        option = "--anchor" if anchors else "--closed"
        print(
            f"aeros: {option} needs --public-key or --state: anyone can write what is not signed",
            file=sys.stderr,
        )
        return Exit.USAGE
    signed: SignatureReport | None = None
    checkpoints = 0

    def count(record: Record, own: str) -> None:
        nonlocal checkpoints
        checkpoints += record["event"] == CHECKPOINT

    try:
        if key is None:
            chain = _checked(arguments.log, count)
        else:
            signed = verify_signed(arguments.log, read_public_key(key), *anchors)
            chain = _explained(arguments.log, signed.chain)
            if arguments.closed and chain.is_sound and not signed.closed:
                why = "its end is not signed: the writer is still running or was killed"
                chain = replace(chain, bad_record=signed.signed, reason=why)
    except (AnchorError, InvalidKeyError) as fault:
        print(f"aeros: {fault}", file=sys.stderr)
        return Exit.REJECTED
    unnoticed = _undetectable_changes(chain, signed, anchors=len(anchors))
    if arguments.format == "json":
        print_data(
            json.dumps({"log": str(arguments.log), **_verification_json(chain, signed, unnoticed)}, indent=2)
        )
    else:
        if not chain.is_sound:
            print(f"NOT SOUND: {chain.reason}")
        print_table(_verification_rows(chain, signed, checkpoints, unnoticed), least=(len(_NOT_CHECKED),))
    return Exit.SUCCESS if chain.is_sound else Exit.REJECTED


def _own_anchor(state: Path, log: Path) -> Path:
    """Return the path of the anchor that an agent's folder has for a log."""
    registry = Registry(state).folder
    if log.resolve() == (registry / LOG).resolve():
        return anchor_of(registry)
    return default_anchor(state, log.parent)


def _undetectable_changes(chain: AuditReport, signed: SignatureReport | None, *, anchors: int) -> list[str]:
    """List changes to the log that this check cannot detect."""
    if signed is None:
        return ["records removed at the end", "a log, or its end, rewritten with new hashes"]
    found = []
    if not anchors:
        found.append("records removed right after an earlier checkpoint")
        found.append("replacement by another log that the same key signed")
    elif anchors == 1:
        found.append("an earlier log and its anchor put back together")
    loose = chain.records - signed.signed
    if loose > 0 or not signed.closed:
        found.append(f"changes after the newest checkpoint, which {loose} records follow now")
    return found


_NOT_CHECKED: Final = "NOT CHECKED"


def _verification_rows(
    chain: AuditReport, signed: SignatureReport | None, checkpoints: int, unnoticed: list[str]
) -> list[tuple[str, str]]:
    counts = chain.decisions
    counts_text = f"{counts.allowed} allowed, {counts.attenuated} attenuated, {counts.denied} denied"
    if not chain.is_sound:
        return [("before it", f"{chain.records} sound records: {counts_text}")]
    rows = [("chain", f"sound, {chain.records} records: {counts_text}"), ("head", chain.head)]
    if signed is None:
        there = f", though {checkpoints} checkpoints are in the log" if checkpoints else ""
        rows.append(("signatures", f"not checked: no --public-key{there}"))
    else:
        end = (
            "closed by its writer"
            if signed.closed
            else "not closed: the writer is still running or was killed"
        )
        rows.append(("signatures", f"sound, of the first {signed.signed} records; the log is {end}"))
        anchored = f"the first {signed.anchored} records are all there"
        rows.append(("anchor", anchored if signed.anchored else "not checked: no --anchor"))
    return [*rows, *((_NOT_CHECKED, one) for one in unnoticed)]


def _verification_json(
    chain: AuditReport, signed: SignatureReport | None, unnoticed: list[str]
) -> dict[str, Any]:
    counts = chain.decisions
    return {
        "sound": chain.is_sound,
        "records": chain.records,
        "head": chain.head,
        "bad_record": chain.bad_record,
        "why": chain.reason,
        "decisions": {"allowed": counts.allowed, "attenuated": counts.attenuated, "denied": counts.denied},
        "signed_records": None if signed is None else signed.signed,
        "anchored_records": None if signed is None else signed.anchored,
        "closed": None if signed is None else signed.closed,
        "not_noticed": unnoticed,
    }


# show


def _show(arguments: argparse.Namespace) -> Exit:
    site = None if arguments.site is None else _site(arguments.site)

    def look(record: Record, own: str) -> None:
        opened = (
            record["details"].get("site")
            if record["event"] in ("session-opened", "session-resumed")
            else None
        )
        if site is not None and type(opened) is dict and opened.get("digest") != site.digest:
            warning = f"record {record['sequence']} opens a session under a different site file"
            print(f"aeros: {warning}; its rules may differ from those shown", file=sys.stderr)
        if not matches_filters(record, arguments):
            return
        if arguments.format == "json":
            print_data(json.dumps({**record, "hash": own, "why": explain_record(record, site)}))
        else:
            print(format_record(record, site))

    return _require_sound(_checked(arguments.log, look))


def _site(path: Path) -> Site:
    sink = Diagnostics()
    site = load_site(path, sink)
    sink.raise_if_errors()
    assert site is not None  # noqa: S101 - otherwise an error was reported
    return site


def _checked(log: Path, watch: RecordCheck) -> AuditReport:
    return _explained(log, verify_log(log, watch))


def _explained(log: Path, chain: AuditReport) -> AuditReport:
    if not chain.is_sound:
        return replace(chain, reason=explain_problem(log, chain.reason))
    if not chain.records:
        return replace(
            chain, bad_record=0, reason="it holds no record: none was written, or all were removed"
        )
    return chain


def _require_sound(chain: AuditReport) -> Exit:
    if chain.is_sound:
        return Exit.SUCCESS
    upto = " and was read only up to there" if chain.records else ""
    print(f"aeros: the log is not sound{upto}: {chain.reason}", file=sys.stderr)
    return Exit.REJECTED


# replay


def _replay(arguments: argparse.Namespace) -> Exit:
    registry = Registry(arguments.state)
    known: FindConfiguration
    if arguments.ecms is None and arguments.site is None and uses_installed_modules(registry):
        known = PastConfigurations(registry)
    else:
        configurations = module_configurations(arguments)
        known = FolderConfigurations(
            arguments.ecms or default_modules(), arguments.site, registry, configurations
        )
    replay = LogReplay(known, GateMode(arguments.gate))

    def take(record: Record, own: str) -> None:
        replay.replay_record(record)

    chain = _checked(arguments.log, take)
    if arguments.format == "json":
        print_data(json.dumps(_replay_json(replay, chain), indent=2))
    else:
        for one in replay.mismatches:
            print("\n".join(map(escape_invisible, _disagreement(one))))
        part = f", {replay.verdict_only_count} of them by verdict alone" if replay.verdict_only_count else ""
        print(f"{replay.matching_count} decisions reproduced{part}; {len(replay.mismatches)} differ")
    sound = _require_sound(chain)
    return Exit.REJECTED if replay.mismatches else sound


def _disagreement(one: ReplayMismatch) -> list[str]:
    if one.replayed is None:
        return [f"record {one.sequence} cannot be replayed: {one.reason}"]
    return [
        f"record {one.sequence} is not reproduced",
        f"   recorded: {json.dumps(one.recorded)}",
        f"   again:    {json.dumps(one.replayed)}",
    ]


def _replay_json(replay: LogReplay, chain: AuditReport) -> dict[str, Any]:
    return {
        "sound": chain.is_sound,
        "why": chain.reason,
        "agreed": replay.matching_count,
        "verdict_only": replay.verdict_only_count,
        "disagreements": [
            {"sequence": one.sequence, "why": one.reason, "recorded": one.recorded, "again": one.replayed}
            for one in replay.mismatches
        ],
    }


# keygen


def _keygen(arguments: argparse.Namespace) -> Exit:
    try:
        public = make_key(arguments.out)
    except InvalidKeyError as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    print_table(
        [
            ("private key", f"{arguments.out}: `aeros run --audit-key` signs with it; keep it secret"),
            (
                "public key",
                f"{public}: `aeros audit verify --public-key` checks with it; keep a copy elsewhere",
            ),
        ]
    )
    return Exit.SUCCESS
