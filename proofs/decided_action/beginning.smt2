; `StepControl._decide_and_begin` lets the plant begin exactly the action that was decided for the
; request, with the motion that was decided, once, counted against its quotas before; it is watched
; from then on. Where it was denied, or the plant cannot do it, nothing begins.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Act 0)) (((asked) (reduced) (other-act))))
(declare-datatypes ((Started 0)) (((none) (started (act Act)) (wrong))))
(declare-const forwarded Bool)
(declare-const allows Bool)
(declare-const plant-can Bool)
(declare-const stops Bool)
(declare-const begins Bool)
(declare-const way-round Bool)
(define-fun found.0 () Started (ite forwarded (started asked) none))
(define-fun found.1 () Started (ite plant-can found.0 none))
(define-fun found.2 () Started (ite forwarded (started reduced) none))
(define-fun found.3 () Started (ite plant-can found.2 none))
(define-fun found.4 () Started (ite allows found.1 found.3))
(define-fun found () Started found.4)
(assert (! (not (= found (ite (and forwarded plant-can) (started (ite allows asked reduced)) none))) :named negated-conclusion))
(check-sat)
