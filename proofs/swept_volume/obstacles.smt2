; `find_obstacle_contact` finds nothing only where the balls are clear of every obstacle (`breach`),
; or the base stands and the hulls of the links are (`contact`), with the whole clearance.
; unsat: proved
(set-logic ALL)
(declare-const clearance Real)
(declare-fun balls-clear (Real) Bool)
(declare-fun hulls-clear (Real) Bool)
(declare-const has-hulls Bool)
(declare-const holds Bool)
(declare-const drives Bool)
(define-fun nothing.0 () Bool (ite (balls-clear clearance) true false))
(define-fun nothing.1 () Bool (ite (hulls-clear clearance) true false))
(define-fun nothing.2 () Bool (ite (balls-clear clearance) true nothing.1))
(define-fun nothing.3 () Bool (ite drives nothing.0 nothing.2))
(define-fun nothing.4 () Bool (ite has-hulls nothing.3 nothing.0))
(define-fun nothing () Bool nothing.4)
(assert (! (not (=> nothing (or (balls-clear clearance) (and has-hulls (not drives) (hulls-clear clearance))))) :named negated-conclusion))
(check-sat)
