; Where the invariant holds, no two agents are awake, nor between reading and writing who they are;
; and while a child of one that ended has its lock, nobody else is.
; unsat: proved
(set-logic ALL)
(declare-const lock Int)
(declare-const lock~ Int)
(declare-const one.pc Int)
(declare-const one.pc~ Int)
(declare-const two.pc Int)
(declare-const two.pc~ Int)
(declare-const one.child Bool)
(declare-const one.child~ Bool)
(declare-const two.child Bool)
(declare-const two.child~ Bool)
(define-fun invariant () Bool (and (<= 0 lock 3) (and (<= 0 one.pc 12) (=> (= one.pc 0) true) (=> (= one.pc 1) (= lock 1)) (=> (= one.pc 2) (= lock 1)) (=> (= one.pc 3) (= lock 1)) (=> (= one.pc 4) (= lock 1)) (=> (= one.pc 5) (= lock 1)) (=> (= one.pc 6) true) (=> (= one.pc 7) (= lock 1)) (=> (= one.pc 8) true) (=> (= one.pc 9) (= lock 1)) (=> (= one.pc 10) true) (=> (= one.pc 11) true) (=> (= one.pc 12) true)) (and (<= 0 two.pc 12) (=> (= two.pc 0) true) (=> (= two.pc 1) (= lock 2)) (=> (= two.pc 2) (= lock 2)) (=> (= two.pc 3) (= lock 2)) (=> (= two.pc 4) (= lock 2)) (=> (= two.pc 5) (= lock 2)) (=> (= two.pc 6) true) (=> (= two.pc 7) (= lock 2)) (=> (= two.pc 8) true) (=> (= two.pc 9) (= lock 2)) (=> (= two.pc 10) true) (=> (= two.pc 11) true) (=> (= two.pc 12) true))))
(define-fun invariant-after () Bool (let ((lock lock~) (one.pc one.pc~) (two.pc two.pc~) (one.child one.child~) (two.child two.child~)) (and (<= 0 lock 3) (and (<= 0 one.pc 12) (=> (= one.pc 0) true) (=> (= one.pc 1) (= lock 1)) (=> (= one.pc 2) (= lock 1)) (=> (= one.pc 3) (= lock 1)) (=> (= one.pc 4) (= lock 1)) (=> (= one.pc 5) (= lock 1)) (=> (= one.pc 6) true) (=> (= one.pc 7) (= lock 1)) (=> (= one.pc 8) true) (=> (= one.pc 9) (= lock 1)) (=> (= one.pc 10) true) (=> (= one.pc 11) true) (=> (= one.pc 12) true)) (and (<= 0 two.pc 12) (=> (= two.pc 0) true) (=> (= two.pc 1) (= lock 2)) (=> (= two.pc 2) (= lock 2)) (=> (= two.pc 3) (= lock 2)) (=> (= two.pc 4) (= lock 2)) (=> (= two.pc 5) (= lock 2)) (=> (= two.pc 6) true) (=> (= two.pc 7) (= lock 2)) (=> (= two.pc 8) true) (=> (= two.pc 9) (= lock 2)) (=> (= two.pc 10) true) (=> (= two.pc 11) true) (=> (= two.pc 12) true)))))
(assert (! (not (=> invariant (and (not (and (or (= one.pc 3) (= one.pc 4)) (or (= two.pc 3) (= two.pc 4)))) (=> (= lock 1) (not (or (= two.pc 3) (= two.pc 4)))) (=> (= lock 2) (not (or (= one.pc 3) (= one.pc 4))))))) :named negated-conclusion))
(check-sat)
