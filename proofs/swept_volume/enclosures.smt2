; `ball_enclosures` asks for what stays near the chord, with the slack that joints have beside it,
; and adds the radius of the ball.
; unsat: proved
(set-logic ALL)
(declare-const middle Real)
(declare-const half Real)
(declare-const width Real)
(declare-const slack Real)
(declare-const near Real)
(declare-const ball Real)
(define-fun told.q () Real middle)
(define-fun told.chord () Real half)
(define-fun told.room () Real (+ width slack))
(define-fun told.radius () Real (+ ball near))
(assert (! (not (and (= told.q middle) (= told.chord half) (= told.room (+ width slack)) (= told.radius (+ ball near)))) :named negated-conclusion))
(check-sat)
