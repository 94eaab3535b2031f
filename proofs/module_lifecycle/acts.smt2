; `Executor._act` begins an action only of a module that is active as it was, under the
; configuration
; that is in force and locked against change, and not once a stop was asked for.
; unsat: proved
(set-logic ALL)
(declare-const halted Bool)
(declare-const asks Bool)
(declare-const held-back Bool)
(declare-const stop Bool)
(declare-const active-as-it-was Bool)
(declare-const moving Bool)
(declare-const in-force Bool)
(declare-const halted-now Bool)
(declare-const ends Bool)
(define-fun acts.0 () Bool (ite halted-now false true))
(define-fun acts.1 () Bool (ite in-force acts.0 false))
(define-fun acts.2 () Bool (ite active-as-it-was acts.1 false))
(define-fun acts.3 () Bool (ite halted false acts.2))
(define-fun acts.4 () Bool (ite asks acts.3 false))
(define-fun acts.5 () Bool (ite stop false acts.4))
(define-fun acts () Bool acts.5)
(assert (! (not (=> acts (and (not halted) (not stop) active-as-it-was in-force (not halted-now)))) :named negated-conclusion))
(check-sat)
