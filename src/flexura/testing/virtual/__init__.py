"""The test before there is one: simulated hits, and where to put sensors."""
