"""Check that results have equal bits: for a single configuration and in a batch, before and after a change.

    python scripts/check_bits.py [ROBOT ...]           # compare all kinds of calls of this run
    python scripts/check_bits.py --write before.npz    # also store the results
    python scripts/check_bits.py --against before.npz  # also compare with stored results

The script checks every robot of the catalogue, every quantity and all three reference frames. The kinds of
calls are single calls, prepared evaluators, batches, several frames in one pass, and plain Python. Fused
multiply-adds are explicit, and urdfkin has its own sine and cosine, so digests are equal on every machine. If
results differ from the stored results, the script prints the largest difference as a fraction of the stored
bound.

Exit 1: a result is not finite, calls with the same inputs return different bits, or a result differs from the
stored result. With the option `--within 0.1`, a difference from the stored result is allowed up to 0.1 times
the result's error bound.
"""

import argparse
import hashlib
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Self

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # import from this checkout without an installation

import urdfkin
from urdfkin.compiled.preload import ComputeMode, use_only
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray
from urdfkin.robot import Robot
from urdfkin.urdf.catalogue import catalogue
from urdfkin.verify.call import Call
from urdfkin.verify.quantities import Quantity, recursive_quantities
from urdfkin.verify.verifier import compute_bound

#: Sizes of batches. A kernel computes configurations in blocks of eight.
LENGTHS = (1, 2, 7, 8, 9, 100)
#: Numbers of threads of a batch. None means urdfkin's default.
THREADS = (None, 1, 2, 3)
#: Maximum numbers of stored configurations and frames for each robot.
STORED, STORED_FRAMES = 9, 6
#: Index of the configuration that is computed in plain Python and by kernels.
INTERPRETED_INDEX = 3
MODES: tuple[ComputeMode, ...] = ("interpreted", "compiled")

Arrays = Mapping[str, Any]


@dataclass(frozen=True)
class RobotInputs:
    name: str
    robot: Robot
    inputs: tuple[FloatArray, ...]
    frames: tuple[str, ...]

    @classmethod
    def load(cls, name: str, stored: Arrays | None = None) -> Self:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # hide warnings about the robot's file
            robot = urdfkin.load(name, mimic=catalogue()[name].mimic, verify=False)
        if stored is not None:
            inputs = tuple(stored[f"{name}/{x}"] for x in "qva")
            return cls(name, robot, inputs, tuple(stored[f"{name}/frames"].tolist()))
        n = max(LENGTHS)
        v, a = np.random.default_rng(0).standard_normal((2, n, robot.nv))
        evenly = {int(i) for i in np.linspace(0, len(robot.link_names) - 1, STORED_FRAMES - 1)}
        links = [f"link:{robot.link_names[i]}" for i in sorted(evenly)]
        return cls(name, robot, (robot.sample(n), v, a), (robot.tip_frame, *links))

    def calls(self) -> Iterator[tuple[str, Quantity, Reference, tuple[FloatArray, ...]]]:
        for quantity in recursive_quantities():
            for reference in Reference if quantity.has_reference else (Reference.LOCAL_WORLD_ALIGNED,):
                what = f"{self.name}/{quantity.name}/{reference.name}"
                yield what, quantity, reference, self.inputs[: len(quantity.inputs)]

    def compute(
        self,
        quantity: Quantity,
        reference: Reference,
        frame: str | Sequence[str],
        inputs: Sequence[Any],
        threads: int | None = None,
    ) -> FloatArray:
        words = (frame, reference) if quantity.has_reference else (frame,)
        options = {} if threads is None else {"threads": threads}
        result: FloatArray = getattr(self.robot, quantity.method)(*inputs, *words, verify=False, **options)
        return result


def have_equal_bits(x: FloatArray, y: FloatArray) -> bool:
    return x.shape == y.shape and x.tobytes() == y.tobytes()


def find_differences(subject: RobotInputs, now: Arrays) -> Iterator[str]:
    """Yield a message for each difference from a single call, and for results that are not finite."""
    frame = subject.frames[0]
    for call_name, quantity, reference, inputs in subject.calls():
        stored_inputs = [x[:STORED] for x in inputs]
        if not have_equal_bits(
            subject.compute(quantity, reference, subject.frames, stored_inputs), now[call_name]
        ):
            yield f"{call_name}: several frames in one pass"
        rows = list(zip(*inputs, strict=True))
        single = np.stack([subject.compute(quantity, reference, frame, row) for row in rows])
        if not np.isfinite(single).all():
            yield f"{call_name}: a result is not finite"
        fast = getattr(subject.robot.prepare(frame, reference), quantity.method, None)
        if fast is not None:
            out = np.empty_like(single)
            for row, out_row in zip(rows, out, strict=True):
                fast(*row, out=out_row)
            if not have_equal_bits(single, out):
                yield f"{call_name}: prepared"
        for n, threads in product(LENGTHS, THREADS):
            for first in {0, min(5, len(rows) - n)}:
                part = [x[first : first + n] for x in inputs]
                batch = subject.compute(quantity, reference, frame, part, threads)
                for k in range(n):
                    if not have_equal_bits(batch[k], single[first + k]):
                        yield f"{call_name}: row {k} of {n} from {first} on, threads={threads}"


def find_interpreted_differences(subject: RobotInputs) -> Iterator[str]:
    for what, quantity, reference, inputs in subject.calls():
        row, found = [x[INTERPRETED_INDEX] for x in inputs], []
        for way in MODES:
            with use_only(way):
                found.append(subject.compute(quantity, reference, subject.frames, row))
        if not have_equal_bits(*found):
            yield f"{what}: interpreted"


def compute_stored_results(subject: RobotInputs) -> dict[str, Any]:
    stored: dict[str, Any] = {f"{subject.name}/{x}": y for x, y in zip("qva", subject.inputs, strict=True)}
    stored[f"{subject.name}/frames"] = np.array(subject.frames)
    for what, quantity, reference, inputs in subject.calls():
        few = [x[:STORED] for x in inputs]
        parts = [subject.compute(quantity, reference, frame, few) for frame in subject.frames]
        stored[what] = results = np.stack(parts, axis=1)
        call = Call(subject.robot.tree, subject.robot.plan, subject.frames, reference, None, few)
        bound = compute_bound(quantity, call.select(slice(0, STORED)))
        limit = np.broadcast_to(EPS * bound.k * bound.scale, results.shape)
        stored[f"{what}/bound"] = limit.astype(np.float32)
    return stored


def digest(now: Arrays) -> str:
    whole = hashlib.sha256()
    for what in sorted(now):
        if what.count("/") == 2:
            whole.update(what.encode() + np.ascontiguousarray(now[what]).tobytes())
    return whole.hexdigest()[:16]


def difference_ratio(what: str, now: Arrays, stored: Arrays) -> float:
    """Return the largest difference from the stored results, divided by the stored error bound."""
    if have_equal_bits(now[what], stored[what]):
        return 0.0
    apart = np.abs(now[what] - stored[what])
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(apart == 0.0, 0.0, apart / stored[f"{what}/bound"])
    # 0 and -0 are equal, but their bits differ, so the ratio must not be 0.
    return float(np.nan_to_num(shares, nan=np.inf, posinf=np.inf).max()) or sys.float_info.min


def compare_with_stored(name: str, now: Arrays, stored: Arrays) -> tuple[str, float]:
    shares = {what: difference_ratio(what, now, stored) for what in now if what.count("/") == 2}
    others = {what: x for what, x in shares.items() if x}
    if not others:
        return "equal", 0.0
    worst = max(others, key=lambda what: others[what])
    most, where = others[worst], worst.removeprefix(f"{name}/")
    return (
        f"{len(others)} of {len(shares)} results differ, by at most {most:.2g} of the bound ({where})",
        most,
    )


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    option = parser.add_argument
    option("robots", nargs="*", help="names of robots in the catalogue (default: all robots)")
    option("--write", type=Path, help="store the results in this file (.npz)")
    option("--against", type=Path, help="compare the results with those in this file")
    option("--within", type=float, default=0.0, help="allowed difference, as a fraction of the bound")
    options = parser.parse_args(words)
    before = None if options.against is None else np.load(options.against)
    known = catalogue() if before is None else dict.fromkeys(name.partition("/")[0] for name in before)
    everything, wrong = dict[str, Any](), 0
    for name in options.robots or known:
        subject = RobotInputs.load(name, before)
        with use_only("compiled"):
            now = compute_stored_results(subject)
            differences = list(find_differences(subject, now))
        differences += find_interpreted_differences(subject)
        everything |= now
        summary, most = ("", 0.0) if before is None else compare_with_stored(name, now, before)
        print(
            f"{name:28} {digest(now)} {summary}",
            *differences[:3],
            sep="\n    " if differences else " ",
            flush=True,
        )
        wrong += bool(differences) or most > options.within
    print(f"{'all robots':28} {digest(everything)} {wrong} wrong")
    if options.write is not None:
        np.savez_compressed(options.write, **everything)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
