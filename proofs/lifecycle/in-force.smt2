; `InstalledModules._prove_snapshot` and `prove_configuration`, which the memory of proofs calls for
; what it does not know, put a module in force only where it
; is active, is the one that was installed, is proved, with all others, as it is then read, and what it needs is active.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((State 0)) (((absent) (installed) (configured) (active))))
(declare-const state State)
(declare-const needed State)
(declare-const needs-another Bool)
(declare-const proved Bool)
(declare-const all-proved Bool)
(declare-const as-proved Bool)
(declare-const as-installed Bool)
(define-fun in-force.0 () Bool (ite as-proved true false))
(define-fun in-force.1 () Bool (ite as-installed in-force.0 false))
(define-fun in-force.2 () Bool (ite all-proved in-force.1 false))
(define-fun in-force.3 () Bool (ite proved in-force.2 false))
(define-fun in-force.4 () Bool (ite needs-another false in-force.3))
(define-fun in-force.5 () Bool (ite (= state configured) false in-force.4))
(define-fun in-force.6 () Bool (ite (= state installed) false in-force.5))
(define-fun in-force.7 () Bool (ite (= state absent) false in-force.6))
(define-fun in-force () Bool in-force.7)
(assert (! (not (=> in-force (and (= state active) proved all-proved as-proved as-installed (=> needs-another (= needed active))))) :named negated-conclusion))
(check-sat)
