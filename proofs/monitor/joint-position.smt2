; The decided position of a joint, at a place on its path, is that of the piece of the path there,
; at the piece's own parameter; whatever was asked before.
; unsat: proved
(set-logic ALL)
(declare-fun coefficient (Int Int) Real)
(declare-const raises Real)
(declare-const place Real)
(declare-const earlier-place Real)
(declare-const was-asked Bool)
(define-fun piece () Int (ite (<= 2.0 place) 2 (ite (<= 1.0 place) 1 0)))
(define-fun position () Real (+ (coefficient piece 0) (* (- place (to_real piece)) (+ (coefficient piece 1) (* (- place (to_real piece)) (+ (coefficient piece 2) (* (- place (to_real piece)) (coefficient piece 3))))))))
(define-fun found.0 () Real (ite (<= 1.0 place) (+ (* (+ (* (+ (* (coefficient 1 3) (- place 1)) (coefficient 1 2)) (- place 1)) (coefficient 1 1)) (- place 1)) (coefficient 1 0)) (+ (* (+ (* (+ (* (coefficient 0 3) (- place 0)) (coefficient 0 2)) (- place 0)) (coefficient 0 1)) (- place 0)) (coefficient 0 0))))
(define-fun found.1 () Real (ite (<= 2.0 place) (+ (* (+ (* (+ (* (coefficient 2 3) (- place 2)) (coefficient 2 2)) (- place 2)) (coefficient 2 1)) (- place 2)) (coefficient 2 0)) found.0))
(define-fun found.2 () Real (ite (<= 3.0 place) (+ (* (+ (* (+ (* (coefficient 2 3) (- place 2)) (coefficient 2 2)) (- place 2)) (coefficient 2 1)) (- place 2)) (coefficient 2 0)) found.1))
(define-fun found () Real found.2)
(assert (! (not (= found position)) :named negated-conclusion))
(check-sat)
