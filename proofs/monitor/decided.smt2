; `decide` of the check that `_TickCheckWriter` writes keeps each parameter, and each state
; variable that rules read and no tick measures, as decided; no rule holds of them yet. It refuses
; if one is missing.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Found 0)) (((decided) (refused) (wrong))))
(declare-const has.speed Bool)
(declare-const has.cold Bool)
(declare-const still0 Bool)
(declare-const still1 Bool)
(define-fun found.0 () Found (ite has.cold decided refused))
(define-fun found.1 () Found (ite has.speed found.0 refused))
(define-fun found () Found found.1)
(assert (! (not (= found (ite (and has.speed has.cold) decided refused))) :named negated-conclusion))
(check-sat)
