"""How alike modes are, and which is which: pure functions of arrays."""
