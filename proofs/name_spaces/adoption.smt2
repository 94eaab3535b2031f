; `adopted_definitions` makes a predicate of a module out of a definition of the site exactly where
; the module mentions it, and may read all that the definition reads, and none of it is from memory.
; unsat: proved
(set-logic ALL)
(declare-const mentioned Bool)
(declare-const readable Bool)
(declare-const recalled Bool)
(define-fun adopted.0 () Bool (ite mentioned true false))
(define-fun adopted.1 () Bool (ite recalled false adopted.0))
(define-fun adopted.2 () Bool (ite readable adopted.1 false))
(define-fun adopted () Bool adopted.2)
(assert (! (not (= adopted (and mentioned readable (not recalled)))) :named negated-conclusion))
(check-sat)
