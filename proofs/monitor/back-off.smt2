; After `RuntimeMonitor.begin_stop`, `_back_off_violation` is never silent. It answers `BACK_OFF`
; exactly where the site has a kind of action for that, an action was under way, all that is
; measured can be used, and every rule of that kind holds.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Answer 0)) (((silent) (broken) (off) (backs-off) (stays) (faulty) (wrong))))
(declare-const active Bool)
(declare-const has-kind Bool)
(declare-const measured-well Bool)
(declare-const rules-hold Bool)
(define-fun found.0 () Answer (ite rules-hold backs-off broken))
(define-fun found.1 () Answer (ite measured-well found.0 faulty))
(define-fun found.2 () Answer (ite has-kind found.1 stays))
(define-fun found.3 () Answer (ite active found.2 stays))
(define-fun found () Answer found.3)
(assert (! (not (= found (ite (not (and active has-kind)) stays (ite (not measured-well) faulty (ite rules-hold backs-off broken))))) :named negated-conclusion))
(check-sat)
