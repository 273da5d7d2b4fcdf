"""Universal files of measurements and of models, with one vocabulary of datasets, channels and units."""
