; `AuditLog._append` acknowledges a record exactly if its line was written; then number, hash and
; end are those after that line, and the listener gets it. A log that cannot go on writes nothing,
; and a line that was not written changes nothing.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Appended 0)) (((acknowledged) (refused) (wrong))))
(declare-const broken Bool)
(declare-const write-fails Bool)
(declare-const first Bool)
(declare-const listener Bool)
(declare-const time-given Bool)
(declare-const cuts Bool)
(define-fun found.0 () Appended (ite write-fails refused acknowledged))
(define-fun found.1 () Appended (ite broken refused found.0))
(define-fun found () Appended found.1)
(assert (! (not (= found (ite (or broken write-fails) refused acknowledged))) :named negated-conclusion))
(check-sat)
