; `_Follower.compare` compares the measured position with the decided one at the time that has
; passed since the first comparison, when it was measured. A part that is halted is compared with
; nothing until its motion is over, and then with where it was at the next tick.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Found 0)) (((path (elapsed Real) (since Real)) (rests) (free) (wrong))))
(declare-const began Real)
(declare-const now Real)
(declare-const time Real)
(declare-const was-compared Bool)
(declare-const halts Bool)
(declare-const is-over Bool)
(declare-const is-reading Bool)
(define-fun start () Real (ite was-compared began now))
(define-fun at () Real (- (ite is-reading time now) start))
(define-fun found.0 () Found (ite is-over rests free))
(define-fun found.1 () Found (ite is-reading (path (ite (<= (- time began) (/ 0 1)) (/ 0 1) (- time began)) began) (path (ite (<= (- now began) (/ 0 1)) (/ 0 1) (- now began)) began)))
(define-fun found.2 () Found (ite halts found.0 found.1))
(define-fun found.3 () Found (ite is-reading (path (ite (<= (- time now) (/ 0 1)) (/ 0 1) (- time now)) now) (path (ite (<= (- now now) (/ 0 1)) (/ 0 1) (- now now)) now)))
(define-fun found.4 () Found (ite halts found.0 found.3))
(define-fun found.5 () Found (ite was-compared found.2 found.4))
(define-fun found () Found found.5)
(assert (! (not (= found (ite halts (ite is-over rests free) (path (ite (<= 0.0 at) at 0.0) start)))) :named negated-conclusion))
(check-sat)
