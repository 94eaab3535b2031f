; `MonitorRules` compiles for a kind of action each rule of the site on it, once, its condition
; and the common function of the same terms; for two actions each joint rule on them, with its
; roles; and takes the values of each variable and parameter apart by its own form.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Compiled 0)) (((wrong) (compiled (has.first Bool) (has.second Bool) (has.third Bool) (as-one Bool) (of-pairs Bool) (of-forms Bool)))))
(declare-const has-histories Bool)
(declare-const has-motion Bool)
(declare-const applies.first Bool)
(declare-const applies.second Bool)
(declare-const applies.third Bool)
(define-fun found.0 () Compiled (ite applies.third (compiled true true true true true true) (compiled true true false true true true)))
(define-fun found.1 () Compiled (ite applies.third (compiled true false true true true true) (compiled true false false true true true)))
(define-fun found.2 () Compiled (ite applies.second found.0 found.1))
(define-fun found.3 () Compiled (ite applies.third (compiled false true true true true true) (compiled false true false true true true)))
(define-fun found.4 () Compiled (ite applies.third (compiled false false true true true true) (compiled false false false true true true)))
(define-fun found.5 () Compiled (ite applies.second found.3 found.4))
(define-fun found.6 () Compiled (ite applies.first found.2 found.5))
(define-fun found () Compiled found.6)
(assert (! (not (and (not (= found wrong)) (= (has.first found) applies.first) (= (has.second found) applies.second) (= (has.third found) applies.third) (as-one found) (of-pairs found) (of-forms found))) :named negated-conclusion))
(check-sat)
