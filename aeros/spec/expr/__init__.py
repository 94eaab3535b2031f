"""The expression language: surface syntax, types, terms, and the semantics that define it."""
