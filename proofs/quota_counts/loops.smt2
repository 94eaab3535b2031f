; Each loop of the code treats each of its elements by itself, or `loops.toml` says why their number
; does not matter; no part of a sequence is taken elsewhere.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Loop 0)) (((|quotas.QuotaUsageCounter.__init__: for quota in self._quotas|) (|quotas.QuotaUsageCounter.set_quotas: for quota in other._quotas|) (|quotas.QuotaUsageCounter.usage_at: for (times, window) in self._windows|) (|quotas.QuotaUsageCounter.usage_at: for (quota, times) in self._times.items()|) (|quotas.QuotaUsageCounter.count_execution: for quota in self._quotas|) (|quotas.QuotaUsageCounter.usage_at: while times and (not window.contains(times[0], at))|))))
(declare-const loop Loop)
(define-fun by-itself () Bool (or false (= loop |quotas.QuotaUsageCounter.__init__: for quota in self._quotas|) (= loop |quotas.QuotaUsageCounter.set_quotas: for quota in other._quotas|) (= loop |quotas.QuotaUsageCounter.usage_at: for (times, window) in self._windows|) (= loop |quotas.QuotaUsageCounter.usage_at: for (quota, times) in self._times.items()|) (= loop |quotas.QuotaUsageCounter.count_execution: for quota in self._quotas|)))
(define-fun argued () Bool (or false (= loop |quotas.QuotaUsageCounter.usage_at: while times and (not window.contains(times[0], at))|)))
(assert (! (not (or by-itself argued)) :named negated-conclusion))
(check-sat)
