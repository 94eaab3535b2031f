; `RuntimeMonitor._first_violation` is silent exactly where nothing is under watch, or all that is
; measured can be used and every watch holds; else it answers the fault, or the first that does
; not.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Found 0)) (((silent) (faulty) (wrong) (broken.first) (broken.second) (broken.third))))
(declare-const watches Bool)
(declare-const measured-well Bool)
(declare-const first.holds Bool)
(declare-const first.is-rule Bool)
(declare-const second.holds Bool)
(declare-const second.is-rule Bool)
(declare-const third.holds Bool)
(declare-const third.is-rule Bool)
(define-fun found.0 () Found (ite third.holds silent broken.third))
(define-fun found.1 () Found (ite second.holds found.0 broken.second))
(define-fun found.2 () Found (ite first.holds found.1 broken.first))
(define-fun found.3 () Found (ite measured-well found.2 faulty))
(define-fun found.4 () Found (ite watches found.3 silent))
(define-fun found () Found found.4)
(assert (! (not (= found (ite watches (ite measured-well (ite first.holds (ite second.holds (ite third.holds silent broken.third) broken.second) broken.first) faulty) silent))) :named negated-conclusion))
(check-sat)
