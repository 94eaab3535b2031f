; A new monitor watches nothing, and compares joints and base under the names, with the bound and
; with the levers of the site's motion policy.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Found 0)) (((all) (joints-alone) (rates-alone) (free) (wrong))))
(declare-const has-bound Bool)
(declare-const has-motion Bool)
(declare-const base-is-named Bool)
(define-fun found.0 () Found (ite has-motion all free))
(define-fun found.1 () Found (ite has-motion joints-alone free))
(define-fun found.2 () Found (ite base-is-named found.0 found.1))
(define-fun found.3 () Found (ite has-motion rates-alone free))
(define-fun found.4 () Found (ite has-bound found.2 found.3))
(define-fun found () Found found.4)
(assert (! (not (= found (ite has-motion (ite has-bound (ite base-is-named all joints-alone) rates-alone) free))) :named negated-conclusion))
(check-sat)
