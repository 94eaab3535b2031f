; `derivatives` gives the first and second derivative of a cubic piece in its middle.
; unsat: proved
(set-logic ALL)
(declare-const a Real)
(declare-const b Real)
(declare-const c Real)
(declare-const d Real)
(define-fun first () Real (* (/ 3 4) (+ (+ (- b a) (* (/ 2 1) (- c b))) (- d c))))
(define-fun second () Real (/ (+ (* (/ 6 1) (- (- c b) (- b a))) (* (/ 6 1) (- (- d c) (- c b)))) (/ 2 1)))
(assert (! (not (and (= first (* (/ 3 4) (- (+ c d) a b))) (= second (* 3.0 (- (+ a d) b c))))) :named negated-conclusion))
(check-sat)
