; `PostureRange.find_gap` finds no gap only where the balls or the hulls are apart by the room and
; both radii, while the joints up to the inner link stand.
; unsat: proved
(set-logic ALL)
(declare-const room Real)
(declare-const distance Real)
(declare-const radius.balls.inner Real)
(declare-const radius.balls.outer Real)
(declare-const radius.hulls.inner Real)
(declare-const radius.hulls.outer Real)
(declare-fun apart.balls (Real) Bool)
(declare-fun apart.hulls (Real) Bool)
(define-fun nothing.0 () Bool (ite (apart.hulls (+ (+ room radius.hulls.inner) radius.hulls.outer)) true false))
(define-fun nothing.1 () Bool (ite (apart.balls (+ (+ room radius.balls.inner) radius.balls.outer)) true nothing.0))
(define-fun nothing () Bool nothing.1)
(assert (! (=> (and (<= (+ room radius.balls.inner radius.balls.outer) (+ (+ room radius.balls.inner) radius.balls.outer)) (apart.balls (+ (+ room radius.balls.inner) radius.balls.outer))) (apart.balls (+ room radius.balls.inner radius.balls.outer))) :named given.more.balls.0))
(assert (! (=> (and (<= (+ room radius.hulls.inner radius.hulls.outer) (+ (+ room radius.hulls.inner) radius.hulls.outer)) (apart.hulls (+ (+ room radius.hulls.inner) radius.hulls.outer))) (apart.hulls (+ room radius.hulls.inner radius.hulls.outer))) :named given.more.hulls.0))
(assert (! (not (=> nothing (or (apart.balls (+ room radius.balls.inner radius.balls.outer)) (apart.hulls (+ room radius.hulls.inner radius.hulls.outer))))) :named negated-conclusion))
(check-sat)
