; `TimeWindow.contains` exactly where one time is at most 1/10 s after another; that is
; no double.
; unsat: proved
(set-logic ALL)
(declare-const earlier Real)
(declare-const later Real)
(declare-fun rounded (Real) Real)
(define-fun spans.0 () Bool (ite (<= (- later earlier) (/ 1 10)) true false))
(define-fun spans.1 () Bool (ite (<= (rounded (- later earlier)) (/ 3602879701896397 36028797018963968)) spans.0 false))
(define-fun spans.2 () Bool (ite (< (rounded (- later earlier)) (/ 7205759403792793 72057594037927936)) true spans.1))
(define-fun spans () Bool spans.2)
(assert (! (and (=> (<= (- later earlier) (/ 7205759403792793 72057594037927936)) (<= (rounded (- later earlier)) (/ 7205759403792793 72057594037927936))) (=> (>= (- later earlier) (/ 7205759403792793 72057594037927936)) (>= (rounded (- later earlier)) (/ 7205759403792793 72057594037927936)))) :named given.rounding-keeps-order.below))
(assert (! (and (=> (<= (- later earlier) (/ 3602879701896397 36028797018963968)) (<= (rounded (- later earlier)) (/ 3602879701896397 36028797018963968))) (=> (>= (- later earlier) (/ 3602879701896397 36028797018963968)) (>= (rounded (- later earlier)) (/ 3602879701896397 36028797018963968)))) :named given.rounding-keeps-order.above))
(assert (! (= (rounded (- (rounded (- later (rounded (- (rounded (- later earlier)) (rounded (- (rounded (- later earlier)) later)))))) (rounded (+ earlier (rounded (- (rounded (- later earlier)) later)))))) (- (- later earlier) (rounded (- later earlier)))) :named given.twosum))
(assert (! (not (= spans (<= (- later earlier) (/ 1 10)))) :named negated-conclusion))
(check-sat)
