; `joint_rates` hands to `rates_in_time`, for each joint, bounds of its derivatives by the path
; parameter on every piece of the path: those by the piece's parameter, times the number of pieces
; to the power of the order.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Rates 0)) (((rates (a.1-of Real) (a.2-of Real) (a.3-of Real) (a.duration-of Real) (b.1-of Real) (b.2-of Real) (b.3-of Real) (b.duration-of Real)))))
(declare-const earlier.a.1 Real)
(declare-const earlier.a.2 Real)
(declare-const earlier.a.3 Real)
(declare-const earlier.b.1 Real)
(declare-const earlier.b.2 Real)
(declare-const earlier.b.3 Real)
(declare-const later.a.1 Real)
(declare-const later.a.2 Real)
(declare-const later.a.3 Real)
(declare-const later.b.1 Real)
(declare-const later.b.2 Real)
(declare-const later.b.3 Real)
(declare-const pieces Real)
(declare-const duration Real)
(define-fun found () Rates (rates (* (ite (<= later.a.1 earlier.a.1) earlier.a.1 later.a.1) pieces) (* (ite (<= later.a.2 earlier.a.2) earlier.a.2 later.a.2) (* pieces pieces)) (* (ite (<= later.a.3 earlier.a.3) earlier.a.3 later.a.3) (* pieces (* pieces pieces))) duration (* (ite (<= later.b.1 earlier.b.1) earlier.b.1 later.b.1) pieces) (* (ite (<= later.b.2 earlier.b.2) earlier.b.2 later.b.2) (* pieces pieces)) (* (ite (<= later.b.3 earlier.b.3) earlier.b.3 later.b.3) (* pieces (* pieces pieces))) duration))
(assert (! (<= 2.0 pieces) :named given.some-pieces))
(assert (! (not (and (<= (* earlier.a.1 pieces) (a.1-of found)) (<= (* earlier.a.2 pieces pieces) (a.2-of found)) (<= (* earlier.a.3 pieces pieces pieces) (a.3-of found)) (<= (* earlier.b.1 pieces) (b.1-of found)) (<= (* earlier.b.2 pieces pieces) (b.2-of found)) (<= (* earlier.b.3 pieces pieces pieces) (b.3-of found)) (<= (* later.a.1 pieces) (a.1-of found)) (<= (* later.a.2 pieces pieces) (a.2-of found)) (<= (* later.a.3 pieces pieces pieces) (a.3-of found)) (<= (* later.b.1 pieces) (b.1-of found)) (<= (* later.b.2 pieces pieces) (b.2-of found)) (<= (* later.b.3 pieces pieces pieces) (b.3-of found)) (= (a.duration-of found) duration) (= (b.duration-of found) duration))) :named negated-conclusion))
(check-sat)
