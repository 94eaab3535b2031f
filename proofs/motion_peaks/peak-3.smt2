; The derivative of order 3 of the profile by u is nowhere in [0, 1] larger than `TIMING_PEAKS`.
; unsat: proved
(set-logic QF_NRA)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(declare-const u Real)
(define-fun derivative () Real (+ (/ 60 1) (* u (+ (- (/ 360 1)) (* u (+ (/ 360 1) (* u 0.0)))))))
(assert (! (<= 0.0 u 1.0) :named given.in-the-motion))
(assert (! (not (<= (size derivative) (/ 60 1))) :named negated-conclusion))
(check-sat)
