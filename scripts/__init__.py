"""Scripts for maintainers: checks, fuzzing, benchmarks, and scripts that generate pages."""
