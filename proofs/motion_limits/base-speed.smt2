; `_base_too_fast` is empty exactly where the rates of the base are in the site's limits, if it
; has some.
; unsat: proved
(set-logic ALL)
(declare-const raises Bool)
(declare-const has-limits Bool)
(declare-const base.in-limits Bool)
(define-fun nothing.0 () Bool (ite base.in-limits true false))
(define-fun nothing.1 () Bool (ite has-limits nothing.0 true))
(define-fun nothing () Bool nothing.1)
(assert (! (not (= nothing (=> has-limits base.in-limits))) :named negated-conclusion))
(check-sat)
