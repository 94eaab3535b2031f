; `to_plant_parameters` gives every declared parameter in the declared order, with the value that
; was decided: whole numbers as doubles, lists as tuples, in lists too; everything else as it is.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Plant 0)) (((double (value Real)) (integer (whole Real)) (exactly) (changed) (plant (field.0 Plant) (field.1 Plant) (field.2 Plant) (field.3 Plant) (field.4 Plant) (field.5 Plant)) (others))))
(declare-const number Real)
(declare-const first Real)
(declare-const second Real)
(declare-const inner Real)
(declare-const number.is-whole Bool)
(declare-const first.is-whole Bool)
(declare-const second.is-whole Bool)
(declare-const inner.is-whole Bool)
(define-fun executed () Plant (plant (double number) (double first) (double second) (double inner) exactly exactly))
(assert (! (not (= executed (plant (double number) (double first) (double second) (double inner) exactly exactly))) :named negated-conclusion))
(check-sat)
