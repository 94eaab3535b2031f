; `elaborate_shared_variables` lets Φ name a module's variable exactly where the site shares it with
; `in_invariants: true`.
; unsat: proved
(set-logic ALL)
(declare-const shared Bool)
(declare-const stated Bool)
(declare-const value Bool)
(define-fun named.0 () Bool (ite shared true false))
(define-fun named.1 () Bool (ite value named.0 false))
(define-fun named.2 () Bool (ite stated named.1 false))
(define-fun named () Bool named.2)
(assert (! (not (= named (and shared stated value))) :named negated-conclusion))
(check-sat)
