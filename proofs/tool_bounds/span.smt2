; `joint_box` holds the control points of a piece, and so what is between them.
; unsat: proved
(set-logic ALL)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(define-fun larger ((x Real) (y Real)) Real (ite (<= y x) x y))
(declare-const a Real)
(declare-const b Real)
(declare-const c Real)
(declare-const d Real)
(define-fun middle () Real (/ (+ (ite (<= (ite (<= (ite (<= a b) a b) c) (ite (<= a b) a b) c) d) (ite (<= (ite (<= a b) a b) c) (ite (<= a b) a b) c) d) (larger (larger (larger a b) c) d)) (/ 2 1)))
(define-fun width () Real (/ (- (larger (larger (larger a b) c) d) (ite (<= (ite (<= (ite (<= a b) a b) c) (ite (<= a b) a b) c) d) (ite (<= (ite (<= a b) a b) c) (ite (<= a b) a b) c) d)) (/ 2 1)))
(assert (! (not (and (<= (size (- a middle)) width) (<= (size (- b middle)) width) (<= (size (- c middle)) width) (<= (size (- d middle)) width))) :named negated-conclusion))
(check-sat)
