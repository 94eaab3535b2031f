"""`aeros audit show` of a decision that was one on two actions together."""

from __future__ import annotations

from pathlib import Path

from aeros.cli.records.show import explain_record
from aeros.runtime.audit.check import Record
from aeros.runtime.audit.log import verify_log
from tests.unit.runtime.together import Cart, asking, configuration, move, roll


def test_a_joint_denial_names_rule_place_and_the_other_action(tmp_path: Path) -> None:
    cart = Cart(tmp_path / "audit.jsonl", {"reach": asking(move()), "drive": asking(roll())})
    cart.plant.values["charge"] = 0.125
    cart.start("reach")
    cart.start("drive")
    cart.ends(2)
    cart.audit.close()
    found: list[Record] = []
    verify_log(cart.log, lambda record, _: found.append(record))
    decisions = [record for record in found if record["event"] == "decision"]
    assert explain_record(decisions[0], configuration().site) == []
    message = explain_record(decisions[1], configuration().site)
    assert message[0].startswith(
        "AE751 charge-for-both: together with the `move` under way it breaks `charge >= 20 %`"
    )
    assert message[2].strip().startswith("the joint rule is written at")
    assert "site.yaml:" in message[2]
    assert message[3].strip().startswith("`charge`")
    assert "12.5 %" in message[3]
    assert message[4] == f"decided jointly with the actions of records {decisions[0]['sequence']}"
    assert len(explain_record(decisions[1], None)) == 3
