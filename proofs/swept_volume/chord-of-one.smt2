; `path_chord` of a path of 1: each control point is as near to its place on the straight
; way as it says, and that place is on it.
; unsat: proved
(set-logic ALL)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(define-fun larger ((x Real) (y Real)) Real (ite (<= y x) x y))
(declare-const a0 Real)
(declare-const b0 Real)
(declare-const c0 Real)
(declare-const d0 Real)
(define-fun middle () Real (/ (+ a0 d0) (/ 2 1)))
(define-fun half () Real (/ (- d0 a0) (/ 2 1)))
(define-fun width () Real (larger (larger (larger (ite (<= 0 (- (- a0 (/ (+ a0 d0) (/ 2 1))) (* (- (/ 1 1)) (/ (- d0 a0) (/ 2 1))))) (- (- a0 (/ (+ a0 d0) (/ 2 1))) (* (- (/ 1 1)) (/ (- d0 a0) (/ 2 1)))) (- (- (- a0 (/ (+ a0 d0) (/ 2 1))) (* (- (/ 1 1)) (/ (- d0 a0) (/ 2 1)))))) (ite (<= 0 (- (- b0 (/ (+ a0 d0) (/ 2 1))) (* (- (/ 3002399751580331 9007199254740992)) (/ (- d0 a0) (/ 2 1))))) (- (- b0 (/ (+ a0 d0) (/ 2 1))) (* (- (/ 3002399751580331 9007199254740992)) (/ (- d0 a0) (/ 2 1)))) (- (- (- b0 (/ (+ a0 d0) (/ 2 1))) (* (- (/ 3002399751580331 9007199254740992)) (/ (- d0 a0) (/ 2 1))))))) (ite (<= 0 (- (- c0 (/ (+ a0 d0) (/ 2 1))) (* (/ 1501199875790165 4503599627370496) (/ (- d0 a0) (/ 2 1))))) (- (- c0 (/ (+ a0 d0) (/ 2 1))) (* (/ 1501199875790165 4503599627370496) (/ (- d0 a0) (/ 2 1)))) (- (- (- c0 (/ (+ a0 d0) (/ 2 1))) (* (/ 1501199875790165 4503599627370496) (/ (- d0 a0) (/ 2 1))))))) (ite (<= 0 (- (- d0 (/ (+ a0 d0) (/ 2 1))) (* (/ 1 1) (/ (- d0 a0) (/ 2 1))))) (- (- d0 (/ (+ a0 d0) (/ 2 1))) (* (/ 1 1) (/ (- d0 a0) (/ 2 1)))) (- (- (- d0 (/ (+ a0 d0) (/ 2 1))) (* (/ 1 1) (/ (- d0 a0) (/ 2 1))))))))
(assert (! (not (and (<= (- 1.0) (- (/ 1 1)) 1.0) (<= (size (- a0 (+ middle (* (- (/ 1 1)) half)))) width) (<= (- 1.0) (- (/ 3002399751580331 9007199254740992)) 1.0) (<= (size (- b0 (+ middle (* (- (/ 3002399751580331 9007199254740992)) half)))) width) (<= (- 1.0) (/ 1501199875790165 4503599627370496) 1.0) (<= (size (- c0 (+ middle (* (/ 1501199875790165 4503599627370496) half)))) width) (<= (- 1.0) (/ 1 1) 1.0) (<= (size (- d0 (+ middle (* (/ 1 1) half)))) width))) :named negated-conclusion))
(check-sat)
