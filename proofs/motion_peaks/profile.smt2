; The speed and acceleration that `minimum_jerk` gives are the derivatives of its position, which
; goes from 0 to 1 and rests at both ends.
; unsat: proved
(set-logic ALL)
(declare-const u Real)
(define-fun s () Real (+ (/ 0 1) (* u (+ (/ 0 1) (* u (+ (/ 0 1) (* u (+ (/ 10 1) (* u (+ (- (/ 15 1)) (* u (+ (/ 6 1) (* u 0.0)))))))))))))
(define-fun first () Real (+ (/ 0 1) (* u (+ (/ 0 1) (* u (+ (/ 30 1) (* u (+ (- (/ 60 1)) (* u (+ (/ 30 1) (* u 0.0)))))))))))
(define-fun second () Real (+ (/ 0 1) (* u (+ (/ 60 1) (* u (+ (- (/ 180 1)) (* u (+ (/ 120 1) (* u 0.0)))))))))
(define-fun of-s () Real (+ (/ 0 1) (* u (+ (/ 0 1) (* u (+ (/ 30 1) (* u (+ (- (/ 60 1)) (* u (+ (/ 30 1) (* u 0.0)))))))))))
(define-fun of-first () Real (+ (/ 0 1) (* u (+ (/ 60 1) (* u (+ (- (/ 180 1)) (* u (+ (/ 120 1) (* u 0.0)))))))))
(assert (! (not (and (= first of-s) (= second of-first) (=> (= u 0.0) (= s first second 0.0)) (=> (= u 1.0) (and (= s 1.0) (= first second 0.0))))) :named negated-conclusion))
(check-sat)
