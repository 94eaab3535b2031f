"""Back ends of the expression language. Each agrees with `expr.semantics` on every input."""
