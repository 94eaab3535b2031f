"""Back ends of the expression language; each agrees with `expr.semantics` on every input."""
