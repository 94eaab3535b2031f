; `resolve_name` puts the condition of a definition of the site for its name exactly where all that
; it reads may be read, so in Φ exactly where Φ may read that.
; unsat: proved
(set-logic ALL)
(declare-const readable Bool)
(define-fun named.0 () Bool (ite readable true false))
(define-fun named () Bool named.0)
(assert (! (not (= named readable)) :named negated-conclusion))
(check-sat)
