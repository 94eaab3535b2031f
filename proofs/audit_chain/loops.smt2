; Each loop of the code treats each of its elements by itself, or `loops.toml` says why their number
; does not matter; no part of a sequence is taken elsewhere.
; unsat: proved
(set-logic ALL)
(declare-datatypes ((Loop 0)) (((|check._parse: for (name, types) in _TYPES.items()|) (|checkpoints.AuditCheckpoint.details: for name in _TYPES|) (|checkpoints.parse_checkpoint: for (name, types) in _TYPES.items()|) (|checkpoints.CheckpointVerifier.__call__: for anchor in self._anchors|) (|checkpoints.verify_signed: for anchor in anchors|) (|checkpoints.verify_signed: for one in anchored|) (|check.read_prefix: for line in _read_lines(file)|) (|check._check: line[:-HASH_SUFFIX_LENGTH]|) (|checkpoints.CheckpointVerifier.missing_tail: for anchor in self._anchors|))))
(declare-const loop Loop)
(define-fun by-itself () Bool (or false (= loop |check._parse: for (name, types) in _TYPES.items()|) (= loop |checkpoints.AuditCheckpoint.details: for name in _TYPES|) (= loop |checkpoints.parse_checkpoint: for (name, types) in _TYPES.items()|) (= loop |checkpoints.CheckpointVerifier.__call__: for anchor in self._anchors|) (= loop |checkpoints.verify_signed: for anchor in anchors|) (= loop |checkpoints.verify_signed: for one in anchored|)))
(define-fun argued () Bool (or false (= loop |check.read_prefix: for line in _read_lines(file)|) (= loop |check._check: line[:-HASH_SUFFIX_LENGTH]|) (= loop |checkpoints.CheckpointVerifier.missing_tail: for anchor in self._anchors|)))
(assert (! (not (or by-itself argued)) :named negated-conclusion))
(check-sat)
