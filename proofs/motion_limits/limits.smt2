; `_limit_violations` is empty exactly where speed, acceleration and jerk are each at most their
; limit; never where one is not a number.
; unsat: proved
(set-logic ALL)
(declare-const raises Bool)
(declare-datatypes ((Number 0)) (((not-a-number) (finite (value Real)))))
(define-fun at-most ((x Number) (y Number)) Bool (and ((_ is finite) x) ((_ is finite) y) (<= (value x) (value y))))
(declare-const found.speed Number)
(declare-const found.acceleration Number)
(declare-const found.jerk Number)
(declare-const limit.speed Number)
(declare-const limit.acceleration Number)
(declare-const limit.jerk Number)
(define-fun nothing.0 () Bool (ite (at-most found.jerk limit.jerk) true false))
(define-fun nothing.1 () Bool (ite (at-most found.acceleration limit.acceleration) nothing.0 false))
(define-fun nothing.2 () Bool (ite (at-most found.speed limit.speed) nothing.1 false))
(define-fun nothing () Bool nothing.2)
(assert (! (not (= nothing (and (at-most found.speed limit.speed) (at-most found.acceleration limit.acceleration) (at-most found.jerk limit.jerk)))) :named negated-conclusion))
(check-sat)
