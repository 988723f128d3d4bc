"""The parts of `scripts/benchmark.py`.

| modules | content |
|---|---|
| `subject`, `sections`, `where`, `machine` | the measurements |
| `contenders`, `peers`, `generated` | the libraries |
| `timing`, `calls`, `operations` | the methods |
| `tables`, `picture` | the output |
"""
