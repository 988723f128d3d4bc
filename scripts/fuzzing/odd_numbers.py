"""Draw random unusual numbers for a hostile URDF; most of these numbers are legal."""

import math
import random

_TURNS = (0.0, math.pi, -math.pi, math.pi / 2, 1.5708, 3.14159, 1e-9)


def written(rng: random.Random, x: float) -> str:
    """Return a number, or a number very close to it, as text in a random notation."""
    plain = repr(x)
    if rng.random() < 0.85:
        return plain
    return rng.choice((f"+{plain}" if x >= 0.0 else plain, f"{x:.17g}", f"{x:.40e}", f"{x:.3g}", f"{x:E}"))


def vector(rng: random.Random, numbers: list[float]) -> str:
    return " ".join(written(rng, x) for x in numbers)


def tame_length(rng: random.Random) -> float:
    """Return a length of some decimetres, often 0."""
    return rng.choice((0.0, 0.0, round(rng.uniform(-1.0, 1.0), 3), rng.uniform(-1.0, 1.0)))


def odd_length(rng: random.Random) -> float:
    """Return a length from 1e-320 to 1e300; the sum of several such lengths usually does not overflow."""
    ranges = ((-320, 300), (-20, 20), (-6, 8), (-320, -150), (-310, -310))
    exponent = rng.choice([rng.uniform(*ends) for ends in ranges])
    return rng.choice((-1.0, 1.0)) * rng.uniform(1.0, 9.9) * math.pow(10.0, exponent)


def tame_angle(rng: random.Random) -> float:
    """Return an angle within a turn, often a multiple of a quarter turn."""
    return rng.choice((*_TURNS[:4], rng.uniform(-math.pi, math.pi)))


def odd_angle(rng: random.Random) -> float:
    """Return an angle (rad) that is up to 1e15, tiny, or nearly a multiple of a quarter turn."""
    near = rng.choice(_TURNS) + rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-18, -3)
    large = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(0, 15)
    return rng.choice((near, large, 10.0 ** rng.uniform(-320, 0), rng.uniform(-9.0, 9.0), 90.0, 180.0))


def direction(rng: random.Random) -> list[float]:
    """Return a random unit vector, in half of the cases a coordinate axis."""
    if rng.random() < 0.5:
        axis = [0.0, 0.0, 0.0]
        axis[rng.randrange(3)] = rng.choice((1.0, -1.0))
        return axis
    numbers = [rng.gauss(0.0, 1.0) for _ in range(3)]
    return [x / math.hypot(*numbers) for x in numbers]


def odd_axis(rng: random.Random) -> list[float]:
    """Return an axis of unusual length, or an axis that is nearly along a coordinate axis."""
    axis = direction(rng)
    if rng.random() < 0.5:
        tilt = 10.0 ** rng.uniform(-20, -3)
        axis = [x + tilt * rng.gauss(0.0, 1.0) for x in axis]
    size = odd_size(rng)
    return [x * (odd_size(rng) if rng.random() < 0.05 else size) for x in axis]


def odd_quaternion(rng: random.Random) -> list[float]:
    """Return a quaternion of any length, also zero, whose rotation is none, tiny or arbitrary."""
    numbers = rng.choice(
        (
            [0.0, 0.0, 0.0, 1.0],
            [rng.gauss(0.0, 1.0) for _ in range(4)],
            [10.0 ** rng.uniform(-20, -3), 0.0, 0.0, -1.0],
            [0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)],
            [rng.choice((0.0, 1.0, -1.0, 1e-310)) for _ in range(4)],
        )
    )
    size = odd_size(rng)
    return [x * size for x in numbers]


def odd_size(rng: random.Random) -> float:
    """Return the length of a direction: mostly about 1, sometimes near the smallest or largest double."""
    exponent = rng.choice((0.0, 0.0, rng.uniform(-1e-9, 1e-9), rng.uniform(-6, 6), rng.uniform(-170, 170)))
    return math.pow(10.0, rng.uniform(-320, 300) if rng.random() < 0.05 else exponent)


def odd_factor(rng: random.Random) -> float:
    plain = (0.0, -0.0, 1.0, -1.0, 3.7, -0.1, 1e-300, 5e-324)
    return rng.choice((*plain, rng.gauss(0.0, 1.0), -(10.0 ** rng.uniform(-12, 12))))


def odd_range(rng: random.Random, turns: bool) -> tuple[float, float]:
    """Return random limits of a joint: equal, adjacent, far apart, infinite or, rarely, reversed."""
    a = odd_angle(rng) if turns else odd_length(rng)
    b = odd_angle(rng) if turns else odd_length(rng)
    if rng.random() < 0.02:
        return max(a, b), min(a, b)
    far = rng.uniform(-1e6, 1e6)
    drawn = ((min(a, b), max(a, b)), (a, a), (a, math.nextafter(a, math.inf)), (far, far + 1.0))
    plain = ((-1e300, 1e300), (0.0, 0.0), (-0.0, 5e-324), (-math.pi, math.pi))
    return rng.choice((*drawn, *plain))


def odd_limit(rng: random.Random) -> str:
    """Return a text for a limit of effort or jerk; urdfdom rejects some of the texts."""
    refused = ("-1.0", "-5e-324", "inf", "nan", "", "1e400", "0x10", "1.0 ")
    fine = ("0", "-0.0", "1e300", "5e-324", "1e-400")
    return rng.choice(refused) if rng.random() < 0.03 else rng.choice((*fine, written(rng, rng.random())))
