"""Two actions at the same time: decides one beside one under way, and says the codes of the reasons."""

import sys

from aeros.runtime.gate.joint_rules import ActiveAction, JointRules
from aeros.runtime.ports import Reading
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site

UNDER_WAY = act("grip", force=10.0)
ASKED = act("move", target=(0.3, 0.1, 0.05), speed=0.2)

measured = {"human_distance": Reading(3.0, 9.98), "stop_pressed": Reading(False, 9.98)}
one, other = (
    ActiveAction(action, measured, 10.0, record) for record, action in enumerate((ASKED, UNDER_WAY))
)
rules = JointRules(load_site("site.yaml", Diagnostics()), compiled=True)
sys.stdout.write(" ".join(reason.code for reason in rules.objections(one, [other])))
