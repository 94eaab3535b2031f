; `MonitorRules.fast_check` returns None where the site keeps histories, or where a name is no
; state variable; else a check of each rule of the site on this kind, for exactly these variables.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Found 0)) (((none) (kept) (made) (wrong))))
(declare-const has-histories Bool)
(declare-const has-motion Bool)
(declare-const measures-undeclared Bool)
(declare-const compiled Bool)
(declare-const is-full Bool)
(declare-const applies.first Bool)
(declare-const applies.second Bool)
(declare-const applies.third Bool)
(define-fun found.0 () Found (ite compiled kept made))
(define-fun found.1 () Found (ite measures-undeclared none found.0))
(define-fun found.2 () Found (ite has-histories none found.1))
(define-fun found () Found found.2)
(assert (! (not (= found (ite (or has-histories measures-undeclared) none (ite compiled kept made)))) :named negated-conclusion))
(check-sat)
