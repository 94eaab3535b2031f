; The sum of two vectors is no longer than both together.
; unsat: proved
(set-logic QF_NRA)
(declare-const u.long Real)
(declare-const v.long Real)
(declare-const u.v Real)
(declare-const long Real)
(assert (! (and (<= 0.0 u.long) (<= 0.0 v.long) (<= 0.0 long)) :named given.lengths))
(assert (! (= (* long long) (+ (* u.long u.long) (* 2.0 u.v) (* v.long v.long))) :named given.sum))
(assert (! (<= u.v (* u.long v.long)) :named given.cauchy))
(assert (! (not (<= long (+ u.long v.long))) :named negated-conclusion))
(check-sat)
