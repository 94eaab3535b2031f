; Of the induction: a log in which a record was edited, deleted, inserted or moved, and any record
; of the old log stands after that, is not accepted.  The old log is `b`.
; unsat: proved
(set-logic ALL)
(declare-sort Line 0)
(declare-fun a (Int) Line)
(declare-fun b (Int) Line)
(declare-const i Int)
(declare-const k Int)
(declare-const j Int)
(declare-const accepted Bool)
(assert (! (=> (and accepted (= (a k) (b j))) (and (= k j) (=> (<= 0 i k) (= (a i) (b i))))) :named given.by-induction))
(assert (! (not (=> (and (<= 0 i) (< i k)) (not (and accepted (or (and (not (= (a i) (b i))) (= j k) (= (a k) (b j))) (and (= j (+ k 1)) (= (a k) (b j))) (and (= j (- k 1)) (= (a k) (b j))) (and (not (= j k)) (= (a k) (b j)))))))) :named negated-conclusion))
(check-sat)
