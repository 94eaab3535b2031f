"""Type checker of expressions: a traversal of the syntax tree, and typing rules by kind of node."""
