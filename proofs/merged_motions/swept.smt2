; `MergedMotion.swept_motion` has what is left of every joint path, the slack of feedback, and of
; the base's way the part from where it is; `base_at_end` is where that way ends.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Motion 0)) (((motion (start.x-of Real) (start.y-of Real) (start.z-of Real) (rest.x-of Real) (rest.y-of Real) (rest.z-of Real) (end.x-of Real) (end.y-of Real) (end.z-of Real)) (wrong))))
(declare-const base.x Real)
(declare-const base.y Real)
(declare-const base.z Real)
(declare-const way.x Real)
(declare-const way.y Real)
(declare-const way.z Real)
(declare-const feedback Bool)
(declare-const single Bool)
(declare-const s Real)
(define-fun found () Motion (motion (+ base.x (* s way.x)) (+ base.y (* s way.y)) (+ base.z (* s way.z)) (* (- (/ 1 1) s) way.x) (* (- (/ 1 1) s) way.y) (* (- (/ 1 1) s) way.z) (+ base.x way.x) (+ base.y way.y) (+ base.z way.z)))
(assert (! (not (= found (motion (+ base.x (* s way.x)) (+ base.y (* s way.y)) (+ base.z (* s way.z)) (* (- 1.0 s) way.x) (* (- 1.0 s) way.y) (* (- 1.0 s) way.z) (+ base.x way.x) (+ base.y way.y) (+ base.z way.z)))) :named negated-conclusion))
(check-sat)
