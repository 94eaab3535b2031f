; `CheckpointWatch.missing` misses nothing exactly where the log reaches beyond the anchor's record.
; unsat: proved
(set-logic ALL)
(declare-const has-anchor Bool)
(declare-const anchored Int)
(declare-const records Int)
(define-fun whole.0 () Bool (ite (< anchored records) true false))
(define-fun whole.1 () Bool (ite has-anchor whole.0 true))
(define-fun whole () Bool whole.1)
(assert (! (not (= whole (or (not has-anchor) (< anchored records)))) :named negated-conclusion))
(check-sat)
