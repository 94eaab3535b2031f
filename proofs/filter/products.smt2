; A product is no larger than that of bounds of its factors.
; unsat: proved
(set-logic ALL)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(declare-const x Real)
(declare-const y Real)
(declare-const x.size Real)
(declare-const y.size Real)
(assert (! (<= (size x) x.size) :named given.x))
(assert (! (<= (size y) y.size) :named given.y))
(assert (! (not (<= (size (* x y)) (* x.size y.size))) :named negated-conclusion))
(check-sat)
