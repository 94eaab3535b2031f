; `derivatives` bounds the first derivative of a cubic piece wherever it is, by its parameter x.
; unsat: proved
(set-logic QF_NRA)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(declare-const a Real)
(declare-const b Real)
(declare-const c Real)
(declare-const d Real)
(declare-const x Real)
(define-fun y () Real (- 1.0 x))
(define-fun bound () Real (* (/ 3 1) (ite (<= (ite (<= 0 (- d c)) (- d c) (- (- d c))) (ite (<= (ite (<= 0 (- c b)) (- c b) (- (- c b))) (ite (<= 0 (- b a)) (- b a) (- (- b a)))) (ite (<= 0 (- b a)) (- b a) (- (- b a))) (ite (<= 0 (- c b)) (- c b) (- (- c b))))) (ite (<= (ite (<= 0 (- c b)) (- c b) (- (- c b))) (ite (<= 0 (- b a)) (- b a) (- (- b a)))) (ite (<= 0 (- b a)) (- b a) (- (- b a))) (ite (<= 0 (- c b)) (- c b) (- (- c b)))) (ite (<= 0 (- d c)) (- d c) (- (- d c))))))
(assert (! (<= 0.0 x 1.0) :named given.on-the-piece))
(assert (! (not (<= (size (* 3.0 (+ (* (- b a) y y) (* 2.0 (- c b) x y) (* (- d c) x x)))) bound)) :named negated-conclusion))
(check-sat)
