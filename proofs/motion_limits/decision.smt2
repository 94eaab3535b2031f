; `MotionDecider.decide` returns the decision that it was given where nothing objects to the
; motion, or where there is no motion to decide: no action, a kind that the policy does not cover,
; or one that the plant has already ended. Else it denies, with no action.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Found 0)) (((same) (denied) (wrong))))
(declare-const is-completed Bool)
(declare-const has-action Bool)
(declare-const is-covered Bool)
(declare-const has-policy Bool)
(declare-const obeys Bool)
(declare-const attenuated Bool)
(define-fun found.0 () Found (ite obeys same denied))
(define-fun found.1 () Found (ite has-policy found.0 same))
(define-fun found.2 () Found (ite is-covered found.1 same))
(define-fun found.3 () Found (ite has-action found.2 same))
(define-fun found.4 () Found (ite is-completed same found.3))
(define-fun found () Found found.4)
(assert (! (not (= found (ite (and has-action has-policy is-covered (not is-completed) (not obeys)) denied same))) :named negated-conclusion))
(check-sat)
