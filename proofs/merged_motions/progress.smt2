; `_progress` is no more of the path than has been completed, by the profile, when the share u of
; the duration has passed, and not less than none of it.
; unsat: proved
(set-logic QF_NRA)
(declare-const u Real)
(define-fun completed () Real (ite (<= u 0.0) 0.0 (ite (<= 1.0 u) 1.0 (* u u u (+ (- 10.0 (* 15.0 u)) (* 6.0 u u))))))
(define-fun progress.0 () Real (ite (<= (/ 1 1) u) (/ 9007199245733793 9007199254740992) (ite (<= (- (* (* u (* u u)) (+ (- (/ 10 1) (* (/ 15 1) u)) (* (* (/ 6 1) u) u))) (/ 4835703278458517 4835703278458516698824704)) (/ 0 1)) (/ 0 1) (- (* (* u (* u u)) (+ (- (/ 10 1) (* (/ 15 1) u)) (* (* (/ 6 1) u) u))) (/ 4835703278458517 4835703278458516698824704)))))
(define-fun progress.1 () Real (ite (< (/ 0 1) u) progress.0 (/ 0 1)))
(define-fun progress () Real progress.1)
(assert (! (not (<= 0.0 progress completed)) :named negated-conclusion))
(check-sat)
