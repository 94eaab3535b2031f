; `RuntimeMonitor._measurement_fault` finds the same at each tick, whatever is measured of a
; module's variable that no invariant reads, and whether it was measured before.
; unsat: proved
(set-logic ALL)
(declare-const near.was-measured Bool)
(declare-const formed.near Bool)
(declare-const formed.kettle.hot Bool)
(declare-const has.near Bool)
(declare-const has.kettle.hot Bool)
(define-fun found.with.0 () Bool (ite has.near false true))
(define-fun found.with.1 () Bool (ite near.was-measured false found.with.0))
(define-fun found.with () Bool found.with.1)
(define-fun found.without.0 () Bool (ite has.near false true))
(define-fun found.without.1 () Bool (ite near.was-measured false found.without.0))
(define-fun found.without () Bool found.without.1)
(assert (! (not (= found.with found.without)) :named negated-conclusion))
(check-sat)
