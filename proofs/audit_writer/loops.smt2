; Each loop of the code treats each of its elements by itself, or `loops.toml` says why their number
; does not matter; no part of a sequence is taken elsewhere.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Loop 0)) (((|log._signature_check: for anchor in signing.anchors|) (|log._signature_check: for one in found|) (|log.AuditLog._sign: for anchor in signing.anchors|) (|log.AuditLog._write: while written < len(line)|) (|log.AuditLog._write: line[written:]|))))
(declare-const loop Loop)
(define-fun by-itself () Bool (or false (= loop |log._signature_check: for anchor in signing.anchors|) (= loop |log._signature_check: for one in found|)))
(define-fun argued () Bool (or false (= loop |log.AuditLog._sign: for anchor in signing.anchors|) (= loop |log.AuditLog._write: while written < len(line)|) (= loop |log.AuditLog._write: line[written:]|)))
(assert (! (not (or by-itself argued)) :named negated-conclusion))
(check-sat)
