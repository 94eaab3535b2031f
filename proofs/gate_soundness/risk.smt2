; `_risk_objections` yields nothing exactly where the skill declares the risk of the kind, and the
; site bears that of the skill.
; unsat: proved
(set-logic ALL)
(declare-const kind.risk Int)
(declare-const skill.risk Int)
(declare-const site.risk Int)
(define-fun nothing.0 () Bool (ite (< site.risk skill.risk) false true))
(define-fun nothing.1 () Bool (ite (< skill.risk kind.risk) false nothing.0))
(define-fun nothing () Bool nothing.1)
(assert (! (not (= nothing (and (<= kind.risk skill.risk) (<= skill.risk site.risk)))) :named negated-conclusion))
(check-sat)
