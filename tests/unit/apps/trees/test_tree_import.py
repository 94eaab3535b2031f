"""Behaviour trees as compositions: each node becomes a part, or is refused with its line and a reason."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.apps.trees.leaves import ImportSettings, identifier
from aeros.apps.trees.library import collect_trees
from aeros.apps.trees.tree_import import MAX_NODES, ImportedTree, import_tree
from aeros.apps.trees.tree_xml import parse_tree

A, B, C = ('<Action ID="OpenGripper"/>', '<Action ID="B"/>', '<Condition ID="IsHolding"/>')
STOP = {"on_failure": "stop"}
DO_A, DO_B = {"skill": "open_gripper"}, {"skill": "b"}
CHECK = {"check": "is_holding"}


def tried(body: str, settings: ImportSettings | None = None, more: str = "") -> ImportedTree:
    text = f'<root BTCPP_format="4">\n<BehaviorTree ID="T">\n{body}\n</BehaviorTree>{more}</root>'
    library = collect_trees([parse_tree(text.encode(), "t.xml")])
    return import_tree(library, "T", settings or ImportSettings())


@pytest.mark.parametrize(
    ("body", "part"),
    [
        (A, DO_A | STOP),
        (f"<Sequence>{A}{B}</Sequence>", {"seq": [DO_A | STOP, DO_B | STOP]}),
        (f"<Sequence>{C}{B}</Sequence>", {"seq": [CHECK, DO_B | STOP]}),
        (f"<Fallback>{A}{B}</Fallback>", {"any": [DO_A, DO_B | STOP]}),
        (f"<Sequence><Fallback>{C}{A}</Fallback></Sequence>", {"any": [CHECK, DO_A | STOP]}),
        (f"<ForceSuccess>{A}</ForceSuccess>", {"tolerate": DO_A}),
        (f"<ForceFailure>{A}</ForceFailure>", {"seq": [{"tolerate": DO_A}, {"check": "false"}]}),
        (f'<RetryUntilSuccessful num_attempts="3">{A}</RetryUntilSuccessful>', DO_A | {"retry": 2}),
        (f'<RetryUntilSuccesful num_attempts="1">{A}</RetryUntilSuccesful>', DO_A | STOP),
        (
            f'<RetryUntilSuccessful num_attempts="2"><RetryUntilSuccessful num_attempts="3">{A}'
            "</RetryUntilSuccessful></RetryUntilSuccessful>",
            {"seq": [DO_A | {"retry": 2}], "retry": 1},
        ),
        (
            f'<Repeat num_cycles="2">{A}</Repeat>',
            {"seq": [DO_A | STOP, {"skill": "open_gripper", "id": "open_gripper_2"} | STOP]},
        ),
        (f"<Sequence _external='true' _notes='x'>{A}{B}</Sequence>", {"seq": [DO_A | STOP, DO_B | STOP]}),
        (f"<Parallel>{C}{A}{B}</Parallel>", {"seq": [CHECK, {"par": [DO_A | STOP, DO_B | STOP]}]}),
        (
            f"<IfThenElse>{C}{A}{B}</IfThenElse>",
            {"if": "is_holding", "then": DO_A | STOP, "else": DO_B | STOP},
        ),
        (
            f"<IfThenElse><Inverter>{C}</Inverter>{A}</IfThenElse>",
            {"if": "not (is_holding)", "then": DO_A | STOP, "else": {"check": "false"}},
        ),
        (
            f"<Sequence><Fallback>{C}<Sequence>{C}<AlwaysSuccess/></Sequence></Fallback>{A}</Sequence>",
            {"seq": [{"check": "(is_holding) or ((is_holding) and (true))"}, DO_A | STOP]},
        ),
        (
            f"<ReactiveSequence>{C}{A}</ReactiveSequence>",
            {"hold": "is_holding", "part": DO_A | STOP} | STOP,
        ),
        (
            f"<Fallback><ReactiveSequence>{C}{A}</ReactiveSequence>{B}</Fallback>",
            {"any": [{"hold": "is_holding", "part": DO_A}, DO_B | STOP]},
        ),
        (
            f"<ReactiveFallback><Inverter>{C}</Inverter>{A}</ReactiveFallback>",
            {"any": [{"hold": "not (not (is_holding))", "part": DO_A}, {"check": "not (is_holding)"}]},
        ),
        (
            f"<Sequence><ReactiveFallback>{C}{C}</ReactiveFallback><WhileDoElse>{C}{C}</WhileDoElse>{A}</Sequence>",
            {
                "seq": [
                    {"check": "(is_holding) or (is_holding)"},
                    {"check": "(is_holding) and (is_holding)"},
                    DO_A | STOP,
                ]
            },
        ),
        (
            f"<Parallel><ReactiveSequence>{C}<ForceSuccess>{C}</ForceSuccess></ReactiveSequence>{A}</Parallel>",
            {"seq": [{"seq": [CHECK, {"tolerate": CHECK}]}, DO_A | STOP]},
        ),
        (
            f"<Sequence>{A}<ReactiveFallback>{C}<ForceFailure>{C}</ForceFailure></ReactiveFallback></Sequence>",
            {"seq": [DO_A | STOP, {"any": [CHECK, {"seq": [{"tolerate": CHECK}, {"check": "false"}]}]}]},
        ),
        (f'<Sequence>{A}<Timeout msec="5">{C}</Timeout></Sequence>', {"seq": [DO_A | STOP, CHECK]}),
        ('<Action ID="tidy-wipe"/>', {"skill": "tidy.wipe", "id": "wipe"} | STOP),
        (f'<Timeout msec="1500">{A}</Timeout>', {"timeout": "1500 ms", "part": DO_A | STOP} | STOP),
        (
            '<Action ID="Move" name="Move there" speed="0.2 m/s"/>',
            {"skill": "move", "id": "move_there", "inputs": {"speed": "0.2 m/s"}} | STOP,
        ),
    ],
)
def test_a_node_becomes_a_part(body: str, part: dict[str, Any]) -> None:
    found = tried(body)
    assert found.refused == ()
    assert found.part == part


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (
            f"<ReactiveSequence>{A}\n{B}</ReactiveSequence>",
            "3: ReactiveSequence: it runs its children again from the first",
        ),
        (f"<WhileDoElse>{C}{A}{B}</WhileDoElse>", "3: WhileDoElse: it may change between its children"),
        (f"<WhileDoElse>{C}{C}{C}</WhileDoElse>", "3: WhileDoElse: it may change between its children"),
        (f'<Timeout msec="0">{A}</Timeout>', "3: Timeout: `msec` is 0; a composition needs a number"),
        (f'<Timeout msec="{{t}}">{A}</Timeout>', "`msec` is {t}; a composition needs a number"),
        (f"<Timeout>{A}</Timeout>", "`msec` is missing"),
        ("<Action/>", "3: Action: it has no ID; write the name"),
        (f'<Sequence>{A}<Action ID="Öffne"/></Sequence>', "digits and `_`, not `Ö`; bind it by --action"),
        (f'<Sequence>{A}<Action ID="?"/></Sequence>', "digits and `_`, not its characters; bind it by"),
        (
            f'<Sequence>{A}<Action ID="Open_Gripper"/></Sequence>',
            "`OpenGripper` and `Open_Gripper` are both `open_gripper`; bind one of them by --action",
        ),
        (f"<Sequence _while='x'>{A}</Sequence>", "3: Sequence: `_while` is a script"),
        (f"<Sequence>\n{A}<Script code='x:=1'/></Sequence>", "4: Script: scripts change a blackboard"),
        (f"<Sequence>{A}\n<MoveTo/></Sequence>", "4: MoveTo: no file declares it; bind it by --action"),
        (
            f"<MyControl>{A}\n<MoveTo/></MyControl>",
            "3: MyControl: this control node or decorator",
        ),
        (f"<Inverter>{A}</Inverter>", "3: Inverter: an action's success cannot be made a failure"),
        (
            f"<Sequence>{A}</Sequence>".replace("ce>", 'ce _skipIf="x">', 1),
            "3: Sequence: `_skipIf` is a script",
        ),
        (f'<RetryUntilSuccessful num_attempts="-1">{A}</RetryUntilSuccessful>', "`num_attempts` is -1"),
        (f'<RetryUntilSuccessful num_attempts="{{n}}">{A}</RetryUntilSuccessful>', "`num_attempts` is {n}"),
        (f'<Repeat num_cycles="{"1" * 5000}">{A}</Repeat>', f"`num_cycles` is {'1' * 20}…;"),
        (
            f'<RetryUntilSuccessful num_attempts="{"1" * 5000}">{A}</RetryUntilSuccessful>',
            f"`num_attempts` is {'1' * 20}…;",
        ),
        (f'<Repeat num_cycles="101">{A}</Repeat>', "`num_cycles` is 101"),
        (f'<Parallel failure_count="2">{A}{B}</Parallel>', "it succeeds or fails with some of its children"),
        (f"<Parallel>{A}{C}</Parallel>", "3: Parallel: a child without an action comes after one with an"),
        (f"<IfThenElse>{A}{B}</IfThenElse>", "its first child is not a condition"),
        ('<SubTree ID="Other"/>', "3: SubTree `Other`: no tree `Other` is in these files"),
        ('<SubTree ID="T"/>', "the tree `T` runs itself"),
        ('<Action ID="A" goal="{goal}"/>', "the port `goal` reads `{goal}`, which no leaf before it has"),
        ("<Sequence/>", "it has 0 children; it needs 1 or more"),
        (f"<ForceSuccess>{A}{B}</ForceSuccess>", "it has 2 children; it needs 1"),
        (f'<Sequence hurry="yes">{A}</Sequence>', "`hurry` is not an attribute of it"),
        (C, "2: BehaviorTree `T`: no action is in it"),
        (
            f'<RetryUntilSuccessful num_attempts="2"><SequenceWithMemory>{A}{B}</SequenceWithMemory>'
            "</RetryUntilSuccessful>",
            "it would go on at its failed child",
        ),
        (
            f'<Sequence>\n<Condition ID="StateCondition" expression="holding) or (true"/>{A}</Sequence>',
            "4: Condition `StateCondition`: `holding) or (true` is not a condition on the state",
        ),
        (f'<Sequence><Condition ID="StateCondition"/>{A}</Sequence>', "it has no `expression`"),
        (f'<Sequence><Condition ID="Not"/>{A}</Sequence>', "`not` is not a condition on the state"),
        (f'<Sequence><Condition ID="Near" to="2"/>{A}</Sequence>', "has no port `to`; bind the leaf"),
        ('<Action ID="A" goalX="1" goal_x="2"/>', "the ports `goalX` and `goal_x` are both `goal_x`"),
        (f"<Switch2 variable='x'>{A}{B}{A}</Switch2>", "it reads a blackboard"),
    ],
)
def test_a_node_without_a_counterpart_is_refused(body: str, reason: str) -> None:
    found = tried(body)
    assert found.part is None
    assert reason in "; ".join(f"{one.line}: {one.node}: {one.reason}" for one in found.refused)


def test_leaves_are_bound_to_skills_and_expressions() -> None:
    settings = ImportSettings({"MoveTo": "arm.move"}, {"Near": "distance < 1 m"})
    found = tried("<Sequence><Near/><MoveTo/></Sequence>", settings)
    assert found.part == {"seq": [{"check": "distance < 1 m"}, {"skill": "arm.move", "id": "move"} | STOP]}
    odd = ImportSettings({"MoveTo": "move"}, {"Near": "near) or (true"})
    assert "`near) or (true` is not" in tried("<Sequence><Near/><MoveTo/></Sequence>", odd).refused[0].reason
    models = '<TreeNodesModel><Condition ID="OpenGripper"/></TreeNodesModel>'
    assert "it is declared as Condition" in tried(A, more=models).refused[0].reason
    assert tried("<MoveTo goal='{g}'/>", ImportSettings(assume_actions=True, ignore_ports=True)).part == (
        {"skill": "move_to"} | STOP
    )


def test_a_subtree_is_written_out_with_its_ports() -> None:
    sub = '<BehaviorTree ID="S"><Action ID="Move" speed="{how_fast}"/></BehaviorTree>'
    calls = '<SubTree ID="S" how_fast="1 m/s"/>'
    found = tried(f"<Sequence>{calls}{calls.replace('1', '2')}</Sequence>", more=sub)
    first = {"skill": "move", "inputs": {"speed": "1 m/s"}} | STOP
    second = {"skill": "move", "id": "move_2", "inputs": {"speed": "2 m/s"}} | STOP
    assert found.part == {"seq": [first, second]}


@pytest.mark.parametrize(
    ("call", "is_imported"),
    [
        ('<SubTree ID="S"/>', False),
        ('<SubTree ID="S" w="{w}"/>', True),
        ('<SubTree ID="S" w="{=}"/>', True),
        ('<SubTree ID="S" w="="/>', True),
        ('<SubTree ID="S" w="{other}"/>', False),
        ('<SubTree ID="S" _autoremap="true"/>', True),
        ('<SubTree ID="S" _autoremap="false"/>', False),
        ('<SubTree ID="S" w="{w}" _autoremap="true"/>', True),
        ('<SubTree ID="S" __shared_blackboard="true"/>', False),
    ],
)
def test_a_subtree_reads_only_the_entries_that_its_node_passes_on(call: str, is_imported: bool) -> None:
    models = '<TreeNodesModel><Action ID="Look"><output_port name="width"/></Action></TreeNodesModel>'
    sub = '<BehaviorTree ID="S">\n<Action ID="Grasp" by="{w}"/></BehaviorTree>'
    found = tried(f'<Sequence><Action ID="Look" width="{{w}}"/>{call}</Sequence>', more=sub + models)
    grasp = {"skill": "grasp", "inputs": {"by": {"from": "look.width"}}} | STOP
    assert found.part == ({"seq": [{"skill": "look"} | STOP, grasp]} if is_imported else None)
    if not is_imported and "shared" not in call:
        assert (found.refused[0].line, "reads `{w}`" in found.refused[0].reason) == (5, True)


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        ('<SubTree ID="S" w="1"/>', 'in a file without BTCPP_format="4", `w` of a SubTree is the name'),
        ('<SubTree ID="S" __autoremap="true"/>', "the port `by` reads `{w}`"),
        ('<SubTreePlus ID="S" w="1"/>', ""),
        ('<SubTreePlus ID="S" w="1" __autoremap="1"/>', ""),
        ('<SubTreePlus ID="S" w="1" _autoremap="1"/>', "has `__autoremap`, not `_autoremap`"),
    ],
)
def test_attributes_of_subtrees_have_their_old_meaning_in_old_files(call: str, reason: str) -> None:
    sub = '<BehaviorTree ID="S"><Action ID="Grasp" by="{w}"/></BehaviorTree>'
    text = f'<root><BehaviorTree ID="T">{call}</BehaviorTree>{sub}</root>'
    found = import_tree(collect_trees([parse_tree(text.encode(), "t.xml")]), "T", ImportSettings())
    assert reason in "; ".join(one.reason for one in found.refused)
    assert (found.part is None) == bool(reason)


def test_entries_of_two_subtrees_are_separate() -> None:
    models = '<TreeNodesModel><Action ID="Look"><output_port name="width"/></Action></TreeNodesModel>'
    sub = (
        '<BehaviorTree ID="S"><Sequence><Action ID="Look" width="{w}"/>'
        '<Action ID="Grasp" by="{w}"/></Sequence></BehaviorTree>'
    )
    body = '<Sequence><SubTree ID="S"/><SubTree ID="S"/></Sequence>'
    found = tried(body, more=sub + models)
    assert found.part is not None
    assert [one["seq"][1]["inputs"]["by"]["from"] for one in found.part["seq"]] == [
        *("look.width", "look_2.width")
    ]
    late = body.replace("</Seq", '<Action ID="Grasp" by="{w}"/></Seq')
    assert "reads `{w}`" in tried(late, more=sub + models).refused[0].reason


def test_a_declared_output_becomes_an_input() -> None:
    models = '<TreeNodesModel><Action ID="Look"><output_port name="width"/></Action></TreeNodesModel>'
    look = '<Action ID="Look" width="{w}"/>'
    found = tried(f'<Sequence>{look}<Action ID="Grasp" by="{{w}}"/></Sequence>', more=models)
    assert found.part == {
        "seq": [
            {"skill": "look"} | STOP,
            {"skill": "grasp", "inputs": {"by": {"from": "look.width"}}} | STOP,
        ]
    }
    assert "a second leaf writes `{w}`" in str(
        tried(f"<Sequence>{look}{look}</Sequence>", more=models).refused
    )
    odd = tried('<Action ID="Look" width="3"/>', more=models)
    assert "is not an entry of the blackboard" in str(odd.refused)


def test_a_tree_that_grows_without_end_is_refused() -> None:
    trees = "".join(
        f'<BehaviorTree ID="S{at}"><Sequence>{f"<SubTree ID=%sS{at + 1}%s/>" % (chr(34), chr(34)) * 4}'
        "</Sequence></BehaviorTree>"
        for at in range(8)
    )
    found = tried('<SubTree ID="S0"/>', more=f'{trees}<BehaviorTree ID="S8">{A}</BehaviorTree>')
    assert found.part is None
    assert f"more than {MAX_NODES} nodes" in found.refused[0].reason
    assert len(found.reports) <= MAX_NODES + 1
    wide = tried(f"<Sequence>{A}<Fallback>{C * MAX_NODES}</Fallback>{A}</Sequence>")
    assert (wide.part, len(wide.refused)) == (None, 1)
    assert f"more than {MAX_NODES} nodes" in wide.refused[0].reason


def test_a_tree_that_no_plan_can_hold_is_refused() -> None:
    wide = "".join(f'<Action ID="A{number}"/>' for number in range(101))
    assert "101 actions with those of its subtrees" in tried(f"<Sequence>{wide}</Sequence>").refused[0].reason

    def deep(levels: int) -> ImportedTree:
        return tried(f"<Sequence>{A}<Fallback>{B}" * levels + A + "</Fallback></Sequence>" * levels)

    assert deep(9).part is not None
    assert "its parts are nested 21 deep" in deep(10).refused[0].reason
    assert "more than 60 deep" in deep(40).refused[0].reason
    assert deep(95).part is None


def test_names_become_identifiers() -> None:
    names = ["OpenGripper", "Open  Gripper!", "HTTPServer2", "2 fast", "über", "_"]
    assert [identifier(one) for one in names] == [
        *("open_gripper", "open_gripper", "http_server2", "step_2_fast", "ber", "step")
    ]


def test_a_subtree_that_no_file_has_may_be_a_skill() -> None:
    body = '<Sequence><SubTree ID="Move to Waypoint" _autoremap="false" waypoint="Home"/></Sequence>'
    found = tried(body, ImportSettings({"Move to Waypoint": "move"}))
    assert found.part == {"skill": "move", "inputs": {"waypoint": "Home"}} | STOP
    assert "or bind it to a skill by --action" in tried(body).refused[0].reason


def test_the_report_says_what_became_of_a_parallel_node() -> None:
    notes = [
        tried(f"<Sequence>{A}<Parallel>{body}</Parallel></Sequence>").reports[2].note
        for body in (C + C, C + B)
    ]
    assert notes == ["seq", "seq"]
    assert tried(f"<Parallel>{A}{B}</Parallel>").reports[0].note == "par"


@pytest.mark.parametrize(
    ("port", "call", "end"),
    [
        ('<input_port name="w" default="2 s"/>', '<SubTree ID="S"/>', {"by": "2 s"}),
        ('<input_port name="w" default="2 s"/>', '<SubTree ID="S" w="3 s"/>', {"by": "3 s"}),
        (
            '<inout_port name="w" default="2 s"/>',
            '<SubTree ID="S" _autoremap="true"/>',
            "the port `by` reads `{w}`",
        ),
        (
            '<input_port name="w"/>',
            '<SubTree ID="S"/>',
            "the tree `S` is declared with the port `w`, which has no",
        ),
    ],
)
def test_a_declared_subtree_has_the_defaults_of_its_ports(
    port: str, call: str, end: dict[str, str] | str
) -> None:
    more = (
        '<BehaviorTree ID="S"><Action ID="Wait" by="{w}"/></BehaviorTree>'
        f'<TreeNodesModel><SubTree ID="S">{port}</SubTree></TreeNodesModel>'
    )
    found = tried(call, more=more)
    if isinstance(end, str):
        assert found.refused[0].reason.startswith(end)
    else:
        assert found.part is not None
        assert found.part["inputs"] == end
