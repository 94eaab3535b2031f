; A product grows with its factors, where the other is not negative.
; unsat: proved
(set-logic ALL)
(declare-const factor Real)
(declare-const one Real)
(declare-const other Real)
(assert (! (<= 0.0 factor) :named given.factor))
(assert (! (<= one other) :named given.order))
(assert (! (not (<= (* factor one) (* factor other))) :named negated-conclusion))
(check-sat)
