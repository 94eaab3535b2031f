; Points whose difference along a direction is at least `reach` times its length are that far apart.
; unsat: proved
(set-logic QF_NRA)
(declare-const length Real)
(declare-const distance Real)
(declare-const reach Real)
(declare-const along Real)
(assert (! (< 0.0 length) :named given.direction))
(assert (! (<= (* reach length) along) :named given.found))
(assert (! (<= along (* length distance)) :named given.cauchy))
(assert (! (not (<= reach distance)) :named negated-conclusion))
(check-sat)
