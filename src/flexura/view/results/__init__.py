"""Charts of results: responses, tests, studies."""
