; `prepare_step` makes a step of a request only where its module is in force and has that skill.
; unsat: proved
(set-logic ALL)
(declare-const in-force Bool)
(declare-const has-skill Bool)
(declare-const module-is-a-name Bool)
(declare-const skill-is-a-name Bool)
(define-fun starts.0 () Bool (ite has-skill true false))
(define-fun starts.1 () Bool (ite in-force starts.0 false))
(define-fun starts.2 () Bool (ite skill-is-a-name starts.1 false))
(define-fun starts.3 () Bool (ite module-is-a-name starts.2 false))
(define-fun starts () Bool starts.3)
(assert (! (not (=> starts (and in-force has-skill))) :named negated-conclusion))
(check-sat)
