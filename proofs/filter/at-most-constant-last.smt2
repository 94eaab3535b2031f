; The code of `x <= 1/10` answers exactly of every double x, though 1/10 is none.
; unsat: proved
(set-logic ALL)
(declare-const x Real)
(define-fun answer.0 () Bool (ite (<= x (/ 7205759403792793 72057594037927936)) true false))
(define-fun answer () Bool answer.0)
(assert (! (or (<= x (/ 7205759403792793 72057594037927936)) (<= (/ 3602879701896397 36028797018963968) x)) :named given.a-double))
(assert (! (not (= answer (<= x (/ 1 10)))) :named negated-conclusion))
(check-sat)
