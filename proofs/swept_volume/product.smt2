; A product is no less than minus the product of the sizes of its factors.
; unsat: proved
(set-logic QF_NRA)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(declare-const n Real)
(declare-const beside Real)
(declare-const edge Real)
(assert (! (<= (size beside) edge) :named given.in-the-box))
(assert (! (not (<= (- (* (size n) edge)) (* n beside))) :named negated-conclusion))
(check-sat)
