; Base: a module that was never installed is neither configured nor active.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((State 0)) (((absent) (installed) (configured) (active))))
(declare-datatypes ((Verb 0)) (((install) (configure) (activate) (deactivate) (remove))))
(declare-datatypes ((Moved 0)) (((to (reached State)) (refused) (moves-another))))
(declare-const state State)
(declare-const verb Verb)
(declare-const was-configured Bool)
(declare-const was-activated Bool)
(define-fun invariant ((s State) (c Bool) (a Bool)) Bool (and (= a (= s active)) (=> (or a (= s configured)) c) (=> (= s absent) (not c))))
(define-fun first () State absent)
(assert (! (not (and (= first absent) (invariant first false false))) :named negated-conclusion))
(check-sat)
