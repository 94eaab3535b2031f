; `TimeWindow.contains` exactly where one time is at most 10 s after another; that is
; a double.
; unsat: proved
(set-logic ALL)
(declare-const earlier Real)
(declare-const later Real)
(declare-fun rounded (Real) Real)
(define-fun spans.0 () Bool (ite (<= (rounded (- (rounded (- later (rounded (- (rounded (- later earlier)) (rounded (- (rounded (- later earlier)) later)))))) (rounded (+ earlier (rounded (- (rounded (- later earlier)) later)))))) (/ 0 1)) true false))
(define-fun spans.1 () Bool (ite (<= (- later earlier) (/ 10 1)) true false))
(define-fun spans.2 () Bool (ite (= (rounded (- later earlier)) (/ 10 1)) spans.0 spans.1))
(define-fun spans.3 () Bool (ite (<= (rounded (- later earlier)) (/ 10 1)) spans.2 false))
(define-fun spans.4 () Bool (ite (< (rounded (- later earlier)) (/ 10 1)) true spans.3))
(define-fun spans () Bool spans.4)
(assert (! (and (=> (<= (- later earlier) (/ 10 1)) (<= (rounded (- later earlier)) (/ 10 1))) (=> (>= (- later earlier) (/ 10 1)) (>= (rounded (- later earlier)) (/ 10 1)))) :named given.rounding-keeps-order.below))
(assert (! (and (=> (<= (- later earlier) (/ 10 1)) (<= (rounded (- later earlier)) (/ 10 1))) (=> (>= (- later earlier) (/ 10 1)) (>= (rounded (- later earlier)) (/ 10 1)))) :named given.rounding-keeps-order.above))
(assert (! (= (rounded (- (rounded (- later (rounded (- (rounded (- later earlier)) (rounded (- (rounded (- later earlier)) later)))))) (rounded (+ earlier (rounded (- (rounded (- later earlier)) later)))))) (- (- later earlier) (rounded (- later earlier)))) :named given.twosum))
(assert (! (not (= spans (<= (- later earlier) (/ 10 1)))) :named negated-conclusion))
(check-sat)
