; Of two claims with one id the certificate says PROVED only if neither was left to the gate.
; unsat: proved
(set-logic ALL)
(declare-const guarded.1 Bool)
(declare-const guarded.2 Bool)
(define-fun proved.0 () Bool (ite guarded.2 false true))
(define-fun proved.1 () Bool (ite guarded.1 false proved.0))
(define-fun proved () Bool proved.1)
(assert (! (not (= proved (not (or guarded.1 guarded.2)))) :named negated-conclusion))
(check-sat)
