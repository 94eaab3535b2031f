; `_ContactSearch.search` of a stretch finds nothing only where a pair is apart on all of it, with
; the slack of the joints, or nothing is found on either half of the stretch.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Path 0)) (((piece.0) (piece.1) (one) (other))))
(declare-fun safe (Path) Bool)
(declare-fun apart (Real Real) Bool)
(declare-const width Real)
(declare-const slack Real)
(declare-const clearance Real)
(declare-const gap Real)
(declare-const is-deepest Bool)
(define-fun nothing.0 () Bool (ite (safe other) true false))
(define-fun nothing.1 () Bool (ite (safe one) nothing.0 false))
(define-fun nothing.2 () Bool (ite (< gap clearance) false nothing.1))
(define-fun nothing.3 () Bool (ite (apart (+ width slack) clearance) true nothing.2))
(define-fun nothing () Bool nothing.3)
(assert (! (not (=> nothing (or (apart (+ width slack) clearance) (and (safe one) (safe other))))) :named negated-conclusion))
(check-sat)
