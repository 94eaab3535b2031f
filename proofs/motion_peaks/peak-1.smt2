; The derivative of order 1 of the profile by u is nowhere in [0, 1] larger than `TIMING_PEAKS`.
; unsat: proved
(set-logic QF_NRA)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(declare-const u Real)
(define-fun derivative () Real (+ (/ 0 1) (* u (+ (/ 0 1) (* u (+ (/ 30 1) (* u (+ (- (/ 60 1)) (* u (+ (/ 30 1) (* u 0.0)))))))))))
(assert (! (<= 0.0 u 1.0) :named given.in-the-motion))
(assert (! (not (<= (size derivative) (/ 15 8))) :named negated-conclusion))
(check-sat)
