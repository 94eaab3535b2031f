; The place on the path of joints at a time is the fraction that minimum jerk has completed then,
; in pieces of equal length; after the end it is the last.
; unsat: proved
(set-logic QF_NRA)
(declare-const raises Real)
(declare-const elapsed Real)
(declare-const earlier Real)
(declare-const duration Real)
(declare-const place Real)
(declare-const earlier-place Real)
(declare-const was-asked Bool)
(define-fun u () Real (ite (<= (/ elapsed duration) 1.0) (/ elapsed duration) 1.0))
(define-fun s ((x Real)) Real (+ (* 10.0 x x x) (* (- 15.0) x x x x) (* 6.0 x x x x x)))
(define-fun found () Real (* (* (* (* 3 (ite (<= (/ elapsed duration) (/ 1 1)) (/ elapsed duration) (/ 1 1))) (ite (<= (/ elapsed duration) (/ 1 1)) (/ elapsed duration) (/ 1 1))) (ite (<= (/ elapsed duration) (/ 1 1)) (/ elapsed duration) (/ 1 1))) (+ (- (/ 10 1) (* (/ 15 1) (ite (<= (/ elapsed duration) (/ 1 1)) (/ elapsed duration) (/ 1 1)))) (* (* (/ 6 1) (ite (<= (/ elapsed duration) (/ 1 1)) (/ elapsed duration) (/ 1 1))) (ite (<= (/ elapsed duration) (/ 1 1)) (/ elapsed duration) (/ 1 1))))))
(assert (! (< 0.0 duration) :named given.it-takes-time))
(assert (! (not (= found (* (/ 3 1) (s u)))) :named negated-conclusion))
(check-sat)
