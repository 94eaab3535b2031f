; `evaluate` of `a since b`, at any moment that it looks at: b holds there, or a does and the
; earlier moments have it so; and it is no longer ago than the window.
; unsat: proved
(set-logic ALL)
(declare-const present Real)
(declare-const at Real)
(declare-const is-one Bool)
(declare-const has-before Bool)
(declare-const a.held Bool)
(declare-const b.held Bool)
(declare-const earlier Bool)
(define-fun found.0 () Bool (ite is-one true false))
(define-fun found.1 () Bool (ite is-one earlier false))
(define-fun found.2 () Bool (ite b.held found.0 found.1))
(define-fun found.3 () Bool (ite b.held found.0 false))
(define-fun found.4 () Bool (ite a.held found.2 found.3))
(define-fun found () Bool found.4)
(assert (! (not (= found (and is-one true (or b.held (and a.held earlier))))) :named negated-conclusion))
(check-sat)
