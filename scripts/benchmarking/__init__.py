"""The parts of `scripts/benchmark.py`.

What is measured (`subject`, `sections`, `where`, `machine`), who (`contenders`, `peers`, `generated`), how
(`timing`, `calls`, `operations`), and what becomes of the figures (`tables`, `picture`).
"""
