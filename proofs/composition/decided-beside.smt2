; `_Decider.decide_jointly` forwards what was to be forwarded where nothing objects, and else
; nothing.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Beside 0)) (((same) (deny) (wrong))))
(declare-const nothing-objects Bool)
(declare-const forwarded Bool)
(declare-const attenuated Bool)
(define-fun decided.0 () Beside (ite forwarded same deny))
(define-fun decided.1 () Beside (ite nothing-objects decided.0 deny))
(define-fun decided () Beside decided.1)
(assert (! (not (= decided (ite (and forwarded nothing-objects) same deny))) :named negated-conclusion))
(check-sat)
