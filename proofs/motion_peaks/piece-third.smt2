; `derivatives` bounds the third derivative of a cubic piece wherever it is, by its parameter x.
; unsat: proved
(set-logic QF_NRA)
(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))
(declare-const a Real)
(declare-const b Real)
(declare-const c Real)
(declare-const d Real)
(declare-const x Real)
(define-fun y () Real (- 1.0 x))
(define-fun bound () Real (ite (<= 0 (- (* (/ 6 1) (- (- d c) (- c b))) (* (/ 6 1) (- (- c b) (- b a))))) (- (* (/ 6 1) (- (- d c) (- c b))) (* (/ 6 1) (- (- c b) (- b a)))) (- (- (* (/ 6 1) (- (- d c) (- c b))) (* (/ 6 1) (- (- c b) (- b a)))))))
(assert (! (<= 0.0 x 1.0) :named given.on-the-piece))
(assert (! (not (<= (size (* 6.0 (- (- (- d c) (- c b)) (- (- c b) (- b a))))) bound)) :named negated-conclusion))
(check-sat)
