; `ObservationFilter` hands a skill a module's variable exactly where it is its own, or where the
; site shares it and its module requires the other.
; unsat: proved
(set-logic ALL)
(declare-const shared Bool)
(declare-const required Bool)
(declare-const own Bool)
(define-fun handed.0 () Bool (ite own true false))
(define-fun handed.1 () Bool (ite required true handed.0))
(define-fun handed.2 () Bool (ite shared handed.1 handed.0))
(define-fun handed () Bool handed.2)
(assert (! (not (= handed (or own (and shared required)))) :named negated-conclusion))
(check-sat)
