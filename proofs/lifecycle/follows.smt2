; `FollowedConfiguration.follow` takes another configuration over only while nothing moves, with the
; generation that it was told with it; else it goes on with the one that it had.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Following 0)) (((following (generation Int) (another Bool)))))
(declare-const followed Int)
(declare-const latest Int)
(declare-const told Int)
(declare-const digest-old Int)
(declare-const digest-new Int)
(declare-const follows-one Bool)
(declare-const moving Bool)
(define-fun now.0 () Following (ite (= digest-new digest-old) (following told false) (following told true)))
(define-fun now.1 () Following (ite moving (following followed false) now.0))
(define-fun now.2 () Following (ite (= followed latest) (following followed false) now.1))
(define-fun now.3 () Following (ite follows-one now.2 now.0))
(define-fun now () Following now.3)
(assert (! (not (and (=> (and follows-one moving) (= now (following followed false))) (=> (another now) (= (generation now) told)) (=> (not (= (generation now) followed)) (or (another now) (= digest-old digest-new))))) :named negated-conclusion))
(check-sat)
