; The product of an axis with a vector is no longer than the vector; said of squares.
; unsat: proved
(set-logic QF_NRA)
(declare-const z.x Real)
(declare-const z.y Real)
(declare-const z.z Real)
(declare-const v.x Real)
(declare-const v.y Real)
(declare-const v.z Real)
(assert (! (= (+ (* z.x z.x) (* z.y z.y) (* z.z z.z)) 1.0) :named given.an-axis))
(assert (! (not (<= (+ (* (- (* z.y v.z) (* z.z v.y)) (- (* z.y v.z) (* z.z v.y))) (* (- (* z.z v.x) (* z.x v.z)) (- (* z.z v.x) (* z.x v.z))) (* (- (* z.x v.y) (* z.y v.x)) (- (* z.x v.y) (* z.y v.x)))) (+ (* v.x v.x) (* v.y v.y) (* v.z v.z)))) :named negated-conclusion))
(check-sat)
