; `MotionDecider._malformed` finds no fault in a plan that has none, and raises no exception. It
; finds every single fault: a number that is no double or not finite, a part of another type or
; length, one that can change or be read once only, a path that does not join smoothly, a body
; without a link, ball or hull that a barrier or another link is compared with, or one that moves
; with no joint.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Form 0)) (((formed) (malformed) (raises))))
(declare-const fault Int)
(define-fun found.0 () Form (ite (< fault 1) formed malformed))
(define-fun found.1 () Form (ite (< fault 2) found.0 malformed))
(define-fun found.2 () Form (ite (< fault 5) found.1 malformed))
(define-fun found.3 () Form (ite (< fault 11) found.2 malformed))
(define-fun found.4 () Form (ite (< fault 23) found.3 malformed))
(define-fun found.5 () Form (ite (< fault 46) found.4 malformed))
(define-fun found.6 () Form (ite (< fault 93) found.5 malformed))
(define-fun found.7 () Form (ite (< fault 187) found.6 malformed))
(define-fun found.8 () Form (ite (< fault 375) found.7 malformed))
(define-fun found () Form found.8)
(assert (! (<= 0 fault 749) :named given.numbers-of-faults))
(assert (! (not (= found (ite (= fault 0) formed malformed))) :named negated-conclusion))
(check-sat)
