; `ModulePerception` lets the conditions of a module name a variable of another exactly where the
; module requires the other, and the site shares it, or allows public ones and it is public.
; unsat: proved
(set-logic ALL)
(declare-const shared Bool)
(declare-const required Bool)
(declare-const installed Bool)
(declare-const public Bool)
(declare-const allowed Bool)
(define-fun named.0 () Bool (ite required true false))
(define-fun named.1 () Bool (ite allowed true false))
(define-fun named.2 () Bool (ite required named.1 false))
(define-fun named.3 () Bool (ite public named.2 false))
(define-fun named.4 () Bool (ite shared named.0 named.3))
(define-fun named () Bool named.4)
(assert (! (not (= named (and required (or shared (and public allowed))))) :named negated-conclusion))
(check-sat)
