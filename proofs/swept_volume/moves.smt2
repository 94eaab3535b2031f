; A point that is turned by an angle moves by no more than its distance from the axis times that;
; said of squares. Assumed of the cosine: 1 - cos p <= p^2/2.
; unsat: proved
(set-logic QF_NRA)
(declare-const x Real)
(declare-const y Real)
(declare-const p Real)
(declare-const cp Real)
(declare-const sp Real)
(define-fun dx () Real (- (- (* cp x) (* sp y)) x))
(define-fun dy () Real (- (+ (* sp x) (* cp y)) y))
(assert (! (<= (- 1.0 cp) (/ (* p p) 2.0)) :named given.cosine))
(assert (! (= (+ (* cp cp) (* sp sp)) 1.0) :named given.circle))
(assert (! (not (<= (+ (* dx dx) (* dy dy)) (* p p (+ (* x x) (* y y))))) :named negated-conclusion))
(check-sat)
