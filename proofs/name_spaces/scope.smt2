; `ModulePerception` lets the conditions of a module name a variable of another exactly where the
; site shares it and the module requires the other.
; unsat: proved
(set-logic ALL)
(declare-const shared Bool)
(declare-const required Bool)
(declare-const installed Bool)
(define-fun named.0 () Bool (ite required true false))
(define-fun named.1 () Bool (ite shared named.0 false))
(define-fun named () Bool named.1)
(assert (! (not (= named (and shared required))) :named negated-conclusion))
(check-sat)
