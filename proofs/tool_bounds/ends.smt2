; Between two ends a vector is no longer than the longer of them, as it is their mixture.
; unsat: proved
(set-logic QF_NRA)
(define-fun larger ((x Real) (y Real)) Real (ite (<= y x) x y))
(declare-const share Real)
(declare-const ahead Real)
(declare-const behind Real)
(assert (! (<= 0.0 share 1.0) :named given.share))
(assert (! (not (<= (+ (* share ahead) (* (- 1.0 share) behind)) (larger ahead behind))) :named negated-conclusion))
(check-sat)
