"""What a maintainer runs: fuzzing, and scripts that write generated pages."""
