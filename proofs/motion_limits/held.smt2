; `held_object` returns none only where the site has none, or where it is measured that nothing is
; held; else the box of the site around the tool, with each of its eight corners.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Held 0)) (((none) (box) (wrong))))
(declare-const site-has-one Bool)
(declare-const holds Bool)
(declare-const holds-not Bool)
(declare-const is-measured Bool)
(define-fun found.0 () Held (ite is-measured none box))
(define-fun found.1 () Held (ite holds-not found.0 box))
(define-fun found.2 () Held (ite holds box found.1))
(define-fun found.3 () Held (ite site-has-one found.2 none))
(define-fun found () Held found.3)
(assert (! (not (= found (ite (and site-has-one (not (and is-measured (not holds) holds-not))) box none))) :named negated-conclusion))
(check-sat)
