; Wherever on a cubic piece, its control points have weights that are not negative, and are one
; together.
; unsat: proved
(set-logic QF_NRA)
(declare-const x Real)
(assert (! (<= 0.0 x 1.0) :named given.on-the-piece))
(assert (! (not (and (<= 0.0 (* (- 1.0 x) (- 1.0 x) (- 1.0 x))) (<= 0.0 (* 3.0 (- 1.0 x) (- 1.0 x) x)) (<= 0.0 (* 3.0 (- 1.0 x) x x)) (<= 0.0 (* x x x)) (= (+ (* (- 1.0 x) (- 1.0 x) (- 1.0 x)) (* 3.0 (- 1.0 x) (- 1.0 x) x) (* 3.0 (- 1.0 x) x x) (* x x x)) 1.0))) :named negated-conclusion))
(check-sat)
