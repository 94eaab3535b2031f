; `moves_base` exactly if the base travels along any axis.
; unsat: proved
(set-logic ALL)
(declare-const moves.x Bool)
(declare-const moves.y Bool)
(declare-const moves.z Bool)
(define-fun moves.0 () Bool (ite moves.z true false))
(define-fun moves.1 () Bool (ite moves.y true moves.0))
(define-fun moves.2 () Bool (ite moves.x true moves.1))
(define-fun moves () Bool moves.2)
(assert (! (not (= moves (or moves.x moves.y moves.z))) :named negated-conclusion))
(check-sat)
