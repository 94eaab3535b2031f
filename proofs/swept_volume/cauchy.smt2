; The scalar product of two vectors is no larger than the product of their lengths: the squares of
; these differ by the square of the vector product.
; unsat: proved
(set-logic ALL)
(declare-const u.x Real)
(declare-const u.y Real)
(declare-const u.z Real)
(declare-const v.x Real)
(declare-const v.y Real)
(declare-const v.z Real)
(assert (! (not (= (- (* (+ (* u.x u.x) (* u.y u.y) (* u.z u.z)) (+ (* v.x v.x) (* v.y v.y) (* v.z v.z))) (* (+ (* u.x v.x) (* u.y v.y) (* u.z v.z)) (+ (* u.x v.x) (* u.y v.y) (* u.z v.z)))) (+ (* (- (* u.y v.z) (* u.z v.y)) (- (* u.y v.z) (* u.z v.y))) (* (- (* u.z v.x) (* u.x v.z)) (- (* u.z v.x) (* u.x v.z))) (* (- (* u.x v.y) (* u.y v.x)) (- (* u.x v.y) (* u.y v.x)))))) :named negated-conclusion))
(check-sat)
