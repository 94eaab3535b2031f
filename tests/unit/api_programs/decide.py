import aeros

gate: aeros.Gate = aeros.load_gate("ecms/make_dumplings", skill="wrap")
action: aeros.Action = aeros.act("look", camera="overhead")
observation: aeros.Observation = {"estop_pressed": False}
decision: aeros.Decision = gate.decide(action, observation, time=10.0, ages={"estop_pressed": 0.01})
allowed: aeros.Action | None = decision.action
print(allowed, [reason.rule for reason in decision.reasons])
