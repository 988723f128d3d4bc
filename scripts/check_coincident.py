"""Compare tables of random arms with the arms themselves; axes of the arms nearly coincide.

    python scripts/check_coincident.py                # 1,200 arms, about 15 minutes
    python scripts/check_coincident.py --arms 60      # the first 60 arms

Half of an arm's axes are at most 1 mm and 1e-3 rad from the previous axis (`nearly_coincident` in
`tests/dh/test_compare.py`). For each arm, the script makes a standard and a modified table. For the first 400
arms, the script also makes a strict table. Each table has other signs and joint zeros than the arm, and has
no base and no tool. Each table must agree with its arm. For the first 400 arms, `urdfkin same` also compares
the arm with its standard table, and the script counts the verdicts.

Exit 1: a table differs from its arm.
"""

import argparse
import sys
import warnings
from collections import Counter
from collections.abc import Iterator

from tests.comparison.test_same import same_as_own_table
from tests.dh.arms import CONVENTIONS, disguised
from tests.dh.test_compare import nearly_coincident
from urdfkin.dh import make_dh_table
from urdfkin.dh.compare import TableComparison, compare
from urdfkin.dh.convert import to_convention
from urdfkin.model.chain import make_chain

MAX_STRICT = MAX_SAME = 400


def compare_arm(seed: int) -> Iterator[TableComparison]:
    """Compare an arm's standard and modified table with the arm."""
    tree = nearly_coincident(seed)
    table = disguised(make_dh_table(tree, "tip"), seed)
    for convention in CONVENTIONS:
        yield compare(make_chain(tree, "tip"), to_convention(table, convention))


def compare_strict(seed: int) -> TableComparison:
    tree = nearly_coincident(seed)
    table = make_dh_table(tree, "tip", near_parallel="strict")
    return compare(make_chain(tree, "tip"), disguised(table, seed))


def summarize(results: list[TableComparison]) -> str:
    exact = sum(result.is_exact for result in results)
    different = sum(not result.agrees for result in results)
    agree = len(results) - exact - different
    text = f"{len(results)}: {exact} agree exactly, {agree} agree, {different} differ"
    errors = [result.metres / result.reach for result in results if result.agrees and not result.is_exact]
    return f"{text}; largest error {max(errors):.2g} of the reach" if errors else text


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arms", type=int, default=1200, help="number of arms (default: 1200)")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    results = [result for seed in range(options.arms) for result in compare_arm(seed)]
    print(f"tables {summarize(results)}", flush=True)
    strict = [compare_strict(seed) for seed in range(min(options.arms, MAX_STRICT))]
    print(f"strict tables {summarize(strict)}", flush=True)
    verdicts = Counter(same_as_own_table(seed).verdict.value for seed in range(min(options.arms, MAX_SAME)))
    print("same", *(f"{count} {verdict}" for verdict, count in verdicts.most_common()), sep=", ")
    sys.exit(not all(result.agrees for result in (*results, *strict)))
