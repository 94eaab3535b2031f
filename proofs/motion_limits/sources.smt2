; The rates that are compared are the bounds of the motion's own path, tool and duration; under
; feedback those that the plant declares. A tool is at rest only where no joint moves.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Rates 0)) (((declared) (computed) (computed-at-rest) (wrong))))
(declare-const is-servo Bool)
(declare-const moves-joints Bool)
(define-fun found.0 () Rates (ite moves-joints computed computed-at-rest))
(define-fun found.1 () Rates (ite is-servo declared found.0))
(define-fun found () Rates found.1)
(assert (! (not (= found (ite is-servo declared (ite moves-joints computed computed-at-rest)))) :named negated-conclusion))
(check-sat)
