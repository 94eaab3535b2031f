; `ObservationFilter` hands a skill a variable of the site, under any name, only where its module
; may use the sensor; under the module's name exactly where it is bound, and under the site's name
; unless the module means another variable by it.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Names 0)) (((handed (as-bound Bool) (as-named Bool)))))
(declare-const bound Bool)
(declare-const shadowed Bool)
(declare-const permitted Bool)
(define-fun seen.0 () Names (ite permitted (handed true false) (handed false false)))
(define-fun seen.1 () Names (ite permitted (handed true true) (handed false false)))
(define-fun seen.2 () Names (ite shadowed seen.0 seen.1))
(define-fun seen.3 () Names (ite permitted (handed false true) (handed false false)))
(define-fun seen.4 () Names (ite shadowed (handed false false) seen.3))
(define-fun seen.5 () Names (ite bound seen.2 seen.4))
(define-fun seen () Names seen.5)
(assert (! (not (and (= (as-bound seen) (and permitted bound)) (= (as-named seen) (and permitted (not shadowed))))) :named negated-conclusion))
(check-sat)
