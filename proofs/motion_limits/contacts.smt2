; `_link_contacts` and `_obstacle_contacts` are empty exactly where the sweep finds no two links
; within the site's clearance between links, if it has one, and no obstacle within its clearance.
; unsat: proved
(set-logic ALL)
(declare-const raises Bool)
(declare-const links.meet Bool)
(declare-const obstacles.meet Bool)
(declare-const ends-there Bool)
(declare-const keeps-links-apart Bool)
(define-fun nothing.0 () Bool (ite obstacles.meet false true))
(define-fun nothing.1 () Bool (ite links.meet false nothing.0))
(define-fun nothing.2 () Bool (ite keeps-links-apart nothing.1 nothing.0))
(define-fun nothing () Bool nothing.2)
(assert (! (not (= nothing (and (=> keeps-links-apart (not links.meet)) (not obstacles.meet)))) :named negated-conclusion))
(check-sat)
