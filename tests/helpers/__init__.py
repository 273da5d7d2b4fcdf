"""What several tests share; `pythonpath` in pyproject.toml makes the package importable."""
