; `AuditLog.append` signs a checkpoint after the record exactly if the log is signed and as many
; records as the interval are not.
; unsat: proved
(set-logic ALL)
(declare-const signing Bool)
(declare-const unsigned Int)
(define-fun signs.expected () Bool (and signing (<= 64 unsigned)))
(define-fun signs.0 () Bool (ite (<= 64 unsigned) true false))
(define-fun signs.1 () Bool (ite signing signs.0 false))
(define-fun signs () Bool signs.1)
(assert (! (not (= signs signs.expected)) :named negated-conclusion))
(check-sat)
