"""The parts of `scripts/benchmark.py`: subjects, contenders, the clock, the tables, the page and the plot."""
