; `_third_derivative_bound` is the sum of what bounds each part of the third derivative: by one,
; by two and by three joints, each as long as the reach of the outermost at most.
; unsat: proved
(set-logic ALL)
(declare-const a.0 Real)
(declare-const a.1 Real)
(declare-const a.2 Real)
(declare-const b.0 Real)
(declare-const b.1 Real)
(declare-const b.2 Real)
(declare-const c.0 Real)
(declare-const c.1 Real)
(declare-const c.2 Real)
(declare-const reach.0 Real)
(declare-const reach.1 Real)
(declare-const reach.2 Real)
(define-fun third () Real (+ (+ (+ (/ 0 1) (* reach.0 (+ (+ c.0 (* (/ 3 1) (- (* (+ (/ 0 1) a.0) (+ (/ 0 1) b.0)) (/ 0 1)))) (- (* (+ (/ 0 1) a.0) (* (+ (/ 0 1) a.0) (+ (/ 0 1) a.0))) (/ 0 1))))) (* reach.1 (+ (+ c.1 (* (/ 3 1) (- (* (+ (+ (/ 0 1) a.0) a.1) (+ (+ (/ 0 1) b.0) b.1)) (* (+ (/ 0 1) a.0) (+ (/ 0 1) b.0))))) (- (* (+ (+ (/ 0 1) a.0) a.1) (* (+ (+ (/ 0 1) a.0) a.1) (+ (+ (/ 0 1) a.0) a.1))) (* (+ (/ 0 1) a.0) (* (+ (/ 0 1) a.0) (+ (/ 0 1) a.0))))))) (* reach.2 (+ (+ c.2 (* (/ 3 1) (- (* (+ (+ (+ (/ 0 1) a.0) a.1) a.2) (+ (+ (+ (/ 0 1) b.0) b.1) b.2)) (* (+ (+ (/ 0 1) a.0) a.1) (+ (+ (/ 0 1) b.0) b.1))))) (- (* (+ (+ (+ (/ 0 1) a.0) a.1) a.2) (* (+ (+ (+ (/ 0 1) a.0) a.1) a.2) (+ (+ (+ (/ 0 1) a.0) a.1) a.2))) (* (+ (+ (/ 0 1) a.0) a.1) (* (+ (+ (/ 0 1) a.0) a.1) (+ (+ (/ 0 1) a.0) a.1))))))))
(assert (! (not (= third (+ (* reach.0 c.0) (* reach.1 c.1) (* reach.2 c.2) (* 3.0 reach.0 b.0 a.0) (* 3.0 reach.1 b.0 a.1) (* 3.0 reach.2 b.0 a.2) (* 3.0 reach.1 b.1 a.0) (* 3.0 reach.1 b.1 a.1) (* 3.0 reach.2 b.1 a.2) (* 3.0 reach.2 b.2 a.0) (* 3.0 reach.2 b.2 a.1) (* 3.0 reach.2 b.2 a.2) (* reach.0 a.0 a.0 a.0) (* reach.1 a.0 a.0 a.1) (* reach.2 a.0 a.0 a.2) (* reach.1 a.0 a.1 a.0) (* reach.1 a.0 a.1 a.1) (* reach.2 a.0 a.1 a.2) (* reach.2 a.0 a.2 a.0) (* reach.2 a.0 a.2 a.1) (* reach.2 a.0 a.2 a.2) (* reach.1 a.1 a.0 a.0) (* reach.1 a.1 a.0 a.1) (* reach.2 a.1 a.0 a.2) (* reach.1 a.1 a.1 a.0) (* reach.1 a.1 a.1 a.1) (* reach.2 a.1 a.1 a.2) (* reach.2 a.1 a.2 a.0) (* reach.2 a.1 a.2 a.1) (* reach.2 a.1 a.2 a.2) (* reach.2 a.2 a.0 a.0) (* reach.2 a.2 a.0 a.1) (* reach.2 a.2 a.0 a.2) (* reach.2 a.2 a.1 a.0) (* reach.2 a.2 a.1 a.1) (* reach.2 a.2 a.1 a.2) (* reach.2 a.2 a.2 a.0) (* reach.2 a.2 a.2 a.1) (* reach.2 a.2 a.2 a.2)))) :named negated-conclusion))
(check-sat)
