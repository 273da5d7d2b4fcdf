"""Parameters of a mechanism found from measured frequencies, shapes and responses."""
