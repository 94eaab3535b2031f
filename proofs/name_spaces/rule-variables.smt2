; `Site.rule_variables`, by which the monitor compiles Φ, has a module's variable exactly where Φ
; may read it.
; unsat: proved
(set-logic ALL)
(declare-const of-module Bool)
(declare-const in-invariants Bool)
(define-fun has.0 () Bool (ite in-invariants true false))
(define-fun has.1 () Bool (ite of-module has.0 true))
(define-fun has () Bool has.1)
(assert (! (not (= has (=> of-module in-invariants))) :named negated-conclusion))
(check-sat)
