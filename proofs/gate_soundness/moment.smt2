; `SnapshotUnpacker.scalars` answers exactly where all of a snapshot are declared state variables of
; their forms, with the scalars of these very values.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Scalars 0)) (((current) (none))))
(declare-datatypes ((Answer 0)) (((refused) (scalars (lit Scalars) (near Scalars)))))
(declare-const has.mood Bool)
(declare-const lit.is-formed Bool)
(declare-const near.is-formed Bool)
(define-fun all-can () Bool (and (not has.mood) lit.is-formed near.is-formed))
(define-fun found.0 () Answer (ite near.is-formed (scalars current current) refused))
(define-fun found.1 () Answer (ite lit.is-formed found.0 refused))
(define-fun found.2 () Answer (ite has.mood refused found.1))
(define-fun found () Answer found.2)
(assert (! (not (and (= all-can (not (= found refused))) (=> all-can (and (= (lit found) current) (= (near found) current))))) :named negated-conclusion))
(check-sat)
