"""Functions of vectors of doubles, without branches in the common range: sin, cos, tan, atan, atan2, exp, log, tanh ...

Accuracy over all doubles, as tests/simulate measures it: exp and log within 1 ulp, sin, cos and hypot 1.5, atan and
atan2 2, expm1 2.5, tanh 3, tan 4; the C library's own where it is used.
Arguments beyond the reach of the fast reduction (|x| > 2^40 for angles), and functions that models seldom use, go lane
by lane through the C library.

Methods: reduction after Cody and Waite with fused multiply-adds (three parts of pi/2, two of ln 2); the polynomials'
coefficients are those of fdlibm (Sun Microsystems 1993: k_sin, k_cos, s_atan, e_log) and Taylor's for exp.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from seatruth.simulate.compiler.llvm_ir import IRBuilder, function

_SIN = [
    *(-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04),
    *(2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10),
]
_COS = [
    *(4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05),
    *(-2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11),
]
_ATAN = [
    *(3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01),
    *(-1.11111104054623557880e-01, 9.09088713343650656196e-02, -7.69187620504482999495e-02),
    *(6.66107313738753120669e-02, -5.83357013379057348645e-02, 4.97687799461593236017e-02),
    *(-3.65315727442169155270e-02, 1.62858201153657823623e-02),
]
_LOG = [
    *(6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01, 2.222219843214978396e-01),
    *(1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01),
]
_EXP = [1.0 / math.factorial(n) for n in range(2, 14)]
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)
_LN2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
_TO_INTEGER = 1.5 * 2.0**52
"""Added to a number below 2^51 it leaves the nearest integer in the lowest bits."""
_LARGEST_ANGLE = 2.0**40
_HALF_PI_LOW = 6.123233995736766e-17
_UNLIKELY = "!prof !0"

LIBRARY = (
    *("sin", "cos", "tan", "asin", "acos", "sinh", "cosh", "asinh", "acosh", "atanh", "log1p", "log10", "log2", "cbrt"),
    *("pow", "fmod", "hypot"),
)
"""Functions taken from the C library."""
_BINARY = ("pow", "fmod", "hypot")
DIRECT = {"sqrt": "sqrt", "abs": "fabs", "floor": "floor", "ceil": "ceil", "trunc": "trunc", "copysign": "copysign"}
"""Functions that processors have."""


def declarations(width: int) -> str:
    """What the functions below refer to."""
    v = f"<{width} x double>"
    lines = [f"declare {v} @llvm.{name}.v{width}f64({v})" for name in ("sqrt", "fabs", "floor", "ceil", "trunc")]
    lines += [f"declare {v} @llvm.copysign.v{width}f64({v}, {v})", f"declare {v} @llvm.fma.v{width}f64({v}, {v}, {v})"]
    for name in LIBRARY:
        head = "double, double" if name in _BINARY else "double"
        lines.append(f"declare double @{name}({head}) nounwind willreturn memory(none)")
    return "\n".join(lines) + '\n!0 = !{!"branch_weights", i32 1, i32 1000000}\n'


@cache
def definitions(width: int) -> str:
    """All functions for vectors of one width, as assembly; unused ones are dropped by the compiler."""
    made = [_lane_by_lane(name, width) for name in LIBRARY]
    made += [_sine_and_cosine(width), _with_fallback("hypot", width, _squares_out_of_range, _hypot)]
    for name, arity, body in _DEFINED:
        made.append(function(f"v.{name}", width, arity, body))
    return "\n".join(made)


def call(w: IRBuilder, op: str, args: list[str]) -> str:
    """The call of a function in a body: by the processor, by the functions here, or by the C library."""
    if op in ("sin", "cos"):
        return sine_and_cosine(w, args[0])[op == "cos"]
    if op in DIRECT:
        return w.intrinsic(DIRECT[op], *args)
    name = f"v.{op}" if op in _VECTORISED else f"lanes.{op}"
    parameters = ", ".join(f"{w.vector} {a}" for a in args)
    return w.put(f"call {w.vector} @{name}({parameters})")


def _lane_by_lane(name: str, width: int) -> str:
    def body(w: IRBuilder, args: list[str]) -> str:
        result = "poison"
        for lane in range(width):
            parameters = [w.put(f"extractelement {w.vector} {a}, i32 {lane}") for a in args]
            one = w.put(f"call double @{name}({', '.join(f'double {x}' for x in parameters)})")
            result = w.put(f"insertelement {w.vector} {result}, double {one}, i32 {lane}")
        return result

    attributes = "noinline cold nounwind willreturn memory(none)"
    return function(f"lanes.{name}", width, 2 if name in _BINARY else 1, body, attributes=attributes)


def _with_fallback(name: str, width: int, beyond: Callable[..., str], fast: Callable[..., str]) -> str:
    """The fast function; a vector in which `beyond` holds for an argument goes lane by lane through the C library."""
    w = IRBuilder(width)
    args = ["%a0", "%a1"][: 2 if name in _BINARY else 1]
    parameters = ", ".join(f"{w.vector} {a}" for a in args)
    w.do(f"br i1 {w.any(beyond(w, *args))}, label %fallback, label %fast, {_UNLIKELY}")
    w.label("fallback")
    slow_result = w.put(f"call {w.vector} @lanes.{name}({parameters})")
    w.do("br label %end")
    w.label("fast")
    result = fast(w, *args)
    w.do("br label %end")
    w.label("end")
    result = w.put(f"phi {w.vector} [ {slow_result}, %fallback ], [ {result}, %fast ]")
    return (
        f"define internal {w.vector} @v.{name}({parameters}) alwaysinline {{\nentry:\n{w.text()}\n"
        f"  ret {w.vector} {result}\n}}\n"
    )


def _beyond_reduction(w: IRBuilder, x: str) -> str:
    """An angle beyond the reduction; infinity and NaN are not: they give NaN at once."""
    size = w.intrinsic("fabs", x)
    return w.both(w.compare("ogt", size, w.constant(_LARGEST_ANGLE)), w.compare("olt", size, w.constant(math.inf)))


def _squares_out_of_range(w: IRBuilder, a: str, b: str) -> str:
    """Sides whose squares would overflow or vanish."""
    size = w.add(w.intrinsic("fabs", a), w.intrinsic("fabs", b))
    out = w.either(w.compare("ogt", size, w.constant(2.0**500)), w.compare("olt", size, w.constant(2.0**-480)))
    real = w.both(w.compare("ogt", size, w.constant(0.0)), w.compare("olt", size, w.constant(math.inf)))
    return w.both(out, real)


def _hypot(w: IRBuilder, a: str, b: str) -> str:
    return w.intrinsic("sqrt", w.fma(a, a, w.mul(b, b)))


def _sine_and_cosine(width: int) -> str:
    """v.sincos: both at once, since the two share the reduction and models need them in pairs."""
    w = IRBuilder(width)
    parameters = f"{w.vector} %a0"
    pair = f"{{{w.vector}, {w.vector}}}"
    w.do(f"br i1 {w.any(_beyond_reduction(w, '%a0'))}, label %fallback, label %fast, {_UNLIKELY}")
    w.label("fallback")
    slow = [w.put(f"call {w.vector} @lanes.{name}({parameters})") for name in ("sin", "cos")]
    w.do("br label %end")
    w.label("fast")
    # x = r + n pi/2 with |r| <= pi/4; n stands in the lowest bits of an integer. The first step is exact.
    shifted = w.fma("%a0", w.constant(2.0 / math.pi), w.constant(_TO_INTEGER))
    less = w.sub(w.constant(_TO_INTEGER), shifted)
    r = "%a0"
    for part in _HALF_PI:
        r = w.fma(less, w.constant(part), r)
    z = w.mul(r, r)
    sine = w.fma(w.mul(z, r), w.polynomial(z, _SIN), r)
    cosine = w.fma(z, w.fma(z, w.polynomial(z, _COS), w.constant(-0.5)), w.constant(1.0))
    n = w.bits(shifted)
    odd = w.put(f"trunc {w.integers} {n} to {w.mask}")
    fast = []
    for swapped, kept, quarter in ((cosine, sine, 0), (sine, cosine, 1)):
        turn = w.integer_op("add", n, w.integer(1)) if quarter else n
        sign = w.integer_op("shl", w.integer_op("and", turn, w.integer(2)), w.integer(62))
        fast.append(w.value(w.integer_op("xor", w.bits(w.select(odd, swapped, kept)), sign)))
    w.do("br label %end")
    w.label("end")
    result = [w.put(f"phi {w.vector} [ {a}, %fallback ], [ {b}, %fast ]") for a, b in zip(slow, fast)]
    first = w.put(f"insertvalue {pair} poison, {w.vector} {result[0]}, 0")
    both = w.put(f"insertvalue {pair} {first}, {w.vector} {result[1]}, 1")
    return (
        f"define internal {pair} @v.sincos({parameters}) alwaysinline {{\nentry:\n{w.text()}\n  ret {pair} {both}\n}}\n"
    )


def sine_and_cosine(w: IRBuilder, x: str) -> tuple[str, str]:
    """Both functions of one angle."""
    pair = f"{{{w.vector}, {w.vector}}}"
    result = w.put(f"call {pair} @v.sincos({w.vector} {x})")
    return w.put(f"extractvalue {pair} {result}, 0"), w.put(f"extractvalue {pair} {result}, 1")


def _tan(w: IRBuilder, args: list[str]) -> str:
    return w.div(*sine_and_cosine(w, args[0]))


def _exponential(w: IRBuilder, x: str) -> tuple[str, str]:
    """e^r - 1 and the integer k (in the lowest bits) of x = k ln 2 + r, |r| <= ln 2 / 2."""
    shifted = w.fma(x, w.constant(1.0 / math.log(2.0)), w.constant(_TO_INTEGER))
    k = w.neg(w.sub(shifted, w.constant(_TO_INTEGER)))
    high = w.fma(k, w.constant(_LN2[0]), x)
    r = w.fma(k, w.constant(_LN2[1]), high)
    rest = w.fma(k, w.constant(_LN2[1]), w.sub(high, r))
    z = w.mul(r, r)
    return w.add(r, w.fma(z, w.polynomial(r, _EXP), rest)), w.bits(shifted)


def _scale(w: IRBuilder, k: str) -> str:
    """2^k for integers k in the lowest bits, -1022 < k < 1024."""
    return w.value(w.integer_op("shl", w.integer_op("add", k, w.integer(1023)), w.integer(52)))


def _exp(w: IRBuilder, args: list[str]) -> str:
    x = w.select(w.compare("ogt", args[0], w.constant(720.0)), w.constant(720.0), args[0])
    x = w.select(w.compare("olt", x, w.constant(-760.0)), w.constant(-760.0), x)
    p, k = _exponential(w, x)
    # Near both ends of the range the exponent is moved by 128 and moved back by a multiplication.
    tiny, huge = w.compare("olt", x, w.constant(-700.0)), w.compare("ogt", x, w.constant(700.0))
    back = w.select(tiny, w.constant(2.0**-128), w.select(huge, w.constant(2.0**128), w.constant(1.0)))
    move = w.put(f"select {w.mask} {huge}, {w.integers} {w.integer(-128)}, {w.integers} {w.integer(0)}")
    move = w.put(f"select {w.mask} {tiny}, {w.integers} {w.integer(128)}, {w.integers} {move}")
    scale = _scale(w, w.integer_op("add", k, move))
    return w.mul(w.fma(p, scale, scale), back)


def _expm1(w: IRBuilder, args: list[str]) -> str:
    x = w.select(w.compare("ogt", args[0], w.constant(720.0)), w.constant(720.0), args[0])
    x = w.select(w.compare("olt", x, w.constant(-60.0)), w.constant(-60.0), x)
    p, k = _exponential(w, x)
    huge = w.compare("ogt", x, w.constant(700.0))
    back = w.select(huge, w.constant(2.0**128), w.constant(1.0))
    move = w.put(f"select {w.mask} {huge}, {w.integers} {w.integer(-128)}, {w.integers} {w.integer(0)}")
    scale = _scale(w, w.integer_op("add", k, move))
    result = w.mul(w.fma(p, scale, w.sub(scale, w.select(huge, w.constant(0.0), w.constant(1.0)))), back)
    return w.select(w.compare("oeq", args[0], w.constant(0.0)), args[0], result)


def _tanh(w: IRBuilder, args: list[str]) -> str:
    size = w.intrinsic("fabs", args[0])
    size = w.select(w.compare("ogt", size, w.constant(25.0)), w.constant(25.0), size)
    twice = w.add(size, size)
    e = w.put(f"call {w.vector} @v.expm1({w.vector} {twice})")
    return w.intrinsic("copysign", w.div(e, w.add(e, w.constant(2.0))), args[0])


def _log(w: IRBuilder, args: list[str]) -> str:
    x = args[0]
    small = w.compare("olt", x, w.constant(2.0**-1022))
    scaled = w.select(small, w.mul(x, w.constant(2.0**54)), x)
    bits = w.bits(scaled)
    # Exponent as a double: its integer put into the low bits of 2^52.
    top = w.integer_op("lshr", bits, w.integer(52))
    e = w.sub(w.value(w.integer_op("or", top, w.integer(0x4330000000000000))), w.constant(2.0**52 + 1023.0))
    e = w.add(e, w.select(small, w.constant(-54.0), w.constant(0.0)))
    m = w.value(
        w.integer_op("or", w.integer_op("and", bits, w.integer(0xFFFFFFFFFFFFF)), w.integer(0x3FF0000000000000))
    )
    large = w.compare("ogt", m, w.constant(math.sqrt(2.0)))
    m = w.select(large, w.mul(m, w.constant(0.5)), m)
    e = w.add(e, w.select(large, w.constant(1.0), w.constant(0.0)))
    f = w.sub(m, w.constant(1.0))
    s = w.div(f, w.add(f, w.constant(2.0)))
    z = w.mul(s, s)
    r = w.mul(z, w.polynomial(z, _LOG))
    half = w.mul(w.mul(f, f), w.constant(0.5))
    inner = w.fma(s, w.add(half, r), w.mul(e, w.constant(_LN2[1])))
    result = w.sub(w.mul(e, w.constant(_LN2[0])), w.sub(w.sub(half, inner), f))
    result = w.select(w.compare("oeq", x, w.constant(0.0)), w.constant(-math.inf), result)
    result = w.select(w.compare("olt", x, w.constant(0.0)), w.constant(math.nan), result)
    # Infinity and NaN stay what they are.
    return w.select(w.compare("ult", x, w.constant(math.inf)), w.select(w.compare("uno", x, x), x, result), x)


def _atan2(w: IRBuilder, args: list[str]) -> str:
    y, x = args
    rise, run = w.intrinsic("fabs", y), w.intrinsic("fabs", x)
    steep = w.compare("ogt", rise, run)
    large, small = w.select(steep, rise, run), w.select(steep, run, rise)
    # atan(small/large) = pi/4 + atan((small - large) / (small + large)) brings |z| below tan(pi/8).
    same = w.compare("oeq", small, w.constant(math.inf))  # both infinite: pi/4
    turned = w.either(same, w.compare("ogt", small, w.mul(large, w.constant(math.tan(math.pi / 8.0)))))
    # Halved where the sum could overflow, not where halves could vanish.
    half = w.select(w.compare("ogt", large, w.constant(1.0)), w.constant(0.5), w.constant(1.0))
    above = w.select(turned, w.sub(w.mul(small, half), w.mul(large, half)), small)
    below = w.select(turned, w.fma(small, half, w.mul(large, half)), large)
    ratio = w.div(above, below)
    flat = w.compare("oeq", large, w.constant(0.0))
    z = w.select(flat, w.constant(0.0), w.select(same, w.constant(0.0), ratio))
    zz = w.mul(z, z)
    series = w.neg(w.mul(w.mul(z, zz), w.polynomial(zz, _ATAN)))
    base = w.select(turned, w.constant(math.pi / 4.0), w.constant(0.0))
    low = w.select(turned, w.constant(_HALF_PI_LOW / 2.0), w.constant(0.0))
    # Steep: pi/2 - angle; backwards: pi - angle. Both only change the constant and the sign.
    back = w.compare("olt", w.intrinsic("copysign", w.constant(1.0), x), w.constant(0.0))
    base = w.select(steep, w.sub(w.constant(math.pi / 2.0), base), base)
    low = w.select(steep, w.sub(w.constant(_HALF_PI_LOW), low), low)
    flip = w.select(steep, w.constant(-1.0), w.constant(1.0))
    base = w.select(back, w.sub(w.constant(math.pi), base), base)
    low = w.select(back, w.sub(w.constant(2.0 * _HALF_PI_LOW), low), low)
    flip = w.select(back, w.neg(flip), flip)
    angle = w.add(base, w.fma(flip, z, w.fma(flip, series, low)))
    wrong = w.compare("uno", x, y)
    return w.select(wrong, w.constant(math.nan), w.intrinsic("copysign", angle, y))


def _atan(w: IRBuilder, args: list[str]) -> str:
    return w.put(f"call {w.vector} @v.atan2({w.vector} {args[0]}, {w.vector} {w.constant(1.0)})")


_DEFINED: tuple[tuple[str, int, Callable[[IRBuilder, list[str]], str]], ...] = (
    ("tan", 1, _tan),
    ("exp", 1, _exp),
    ("expm1", 1, _expm1),
    ("tanh", 1, _tanh),
    ("log", 1, _log),
    ("atan2", 2, _atan2),
    ("atan", 1, _atan),
)
_VECTORISED = frozenset(("hypot", *(name for name, _, _ in _DEFINED)))
