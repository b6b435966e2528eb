"""Writes LLVM IR (LLVM's textual assembly) for vectors of doubles: an `IRBuilder` for each function."""

from __future__ import annotations

import struct
from collections.abc import Callable

FLAGS = "nsz arcp"
"""Fast-math flags of the model's arithmetic: zeros without sign, division by reciprocals. No reassociation, and no
fused multiply-adds but those of `lowering`, so that a result does not depend on how many lanes run together; infinities
and NaN stay, so that divergence shows."""


def double(value: float) -> str:
    """A constant in LLVM's hexadecimal form, which keeps all its bits."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


class IRBuilder:
    """The body of one function over vectors of `width` doubles."""

    def __init__(self, width: int, prefix: str = "v") -> None:
        self.width, self.lines = width, list[str]()
        self.vector, self.integers, self.mask = f"<{width} x double>", f"<{width} x i64>", f"<{width} x i1>"
        self._prefix, self._count = prefix, 0
        self._constants: dict[str, str] = {}
        self.entry: list[str] = []
        """Lines that belong at the start of the function (constants)."""

    def name(self) -> str:
        """A new name for a value."""
        self._count += 1
        return f"%{self._prefix}{self._count}"

    def put(self, text: str) -> str:
        """Adds an instruction with a result; returns the result's name."""
        name = self.name()
        self.lines.append(f"  {name} = {text}")
        return name

    def do(self, text: str) -> None:
        """Adds an instruction without a result."""
        self.lines.append(f"  {text}")

    def label(self, name: str) -> None:
        self.lines.append(f"{name}:")

    def constant(self, value: float) -> str:
        return self._splat_constant("double", double(value), self.vector)

    def integer(self, value: int) -> str:
        return self._splat_constant("i64", str(value), self.integers)

    def _splat_constant(self, kind: str, text: str, vector: str) -> str:
        key = f"{kind} {text}"
        if key not in self._constants:
            one, all_ = self.name(), self.name()
            self.entry.append(f"  {one} = insertelement {vector} poison, {kind} {text}, i32 0")
            self.entry.append(f"  {all_} = {self._broadcast(vector, one)}")
            self._constants[key] = all_
        return self._constants[key]

    def splat(self, scalar: str) -> str:
        """A scalar double in every lane."""
        one = self.put(f"insertelement {self.vector} poison, double {scalar}, i32 0")
        return self.put(self._broadcast(self.vector, one))

    def _broadcast(self, vector: str, one: str) -> str:
        return f"shufflevector {vector} {one}, {vector} poison, <{self.width} x i32> zeroinitializer"

    def binary(self, op: str, a: str, b: str, flags: str = "") -> str:
        return self.put(f"{op} {flags + ' ' if flags else ''}{self.vector} {a}, {b}")

    def add(self, a: str, b: str) -> str:
        return self.binary("fadd", a, b)

    def sub(self, a: str, b: str) -> str:
        return self.binary("fsub", a, b)

    def mul(self, a: str, b: str) -> str:
        return self.binary("fmul", a, b)

    def div(self, a: str, b: str) -> str:
        return self.binary("fdiv", a, b)

    def neg(self, a: str) -> str:
        return self.put(f"fneg {self.vector} {a}")

    def fma(self, a: str, b: str, c: str) -> str:
        """a b + c with one rounding."""
        v = self.vector
        return self.put(f"call {v} @llvm.fma.v{self.width}f64({v} {a}, {v} {b}, {v} {c})")

    def intrinsic(self, name: str, *args: str) -> str:
        arguments = ", ".join(f"{self.vector} {a}" for a in args)
        return self.put(f"call {self.vector} @llvm.{name}.v{self.width}f64({arguments})")

    def compare(self, relation: str, a: str, b: str) -> str:
        return self.put(f"fcmp {relation} {self.vector} {a}, {b}")

    def select(self, mask: str, yes: str, no: str) -> str:
        return self.put(f"select {self.mask} {mask}, {self.vector} {yes}, {self.vector} {no}")

    def both(self, a: str, b: str) -> str:
        return self.put(f"and {self.mask} {a}, {b}")

    def either(self, a: str, b: str) -> str:
        return self.put(f"or {self.mask} {a}, {b}")

    def bits(self, a: str) -> str:
        return self.put(f"bitcast {self.vector} {a} to {self.integers}")

    def value(self, bits: str) -> str:
        return self.put(f"bitcast {self.integers} {bits} to {self.vector}")

    def integer_op(self, op: str, a: str, b: str) -> str:
        return self.put(f"{op} {self.integers} {a}, {b}")

    def any(self, mask: str) -> str:
        """Whether a lane of the mask is set: an i1."""
        word = self.put(f"bitcast {self.mask} {mask} to i{self.width}")
        return self.put(f"icmp ne i{self.width} {word}, 0")

    def polynomial(self, x: str, coefficients: list[float]) -> str:
        """c0 + c1 x + c2 x2 ..., in pairs (Estrin's scheme), which keeps the chain of multiply-adds short."""
        terms = [self.constant(c) for c in coefficients]
        power = x
        while len(terms) > 1:
            paired = [self.fma(terms[k + 1], power, terms[k]) for k in range(0, len(terms) - 1, 2)]
            if len(terms) % 2:
                paired.append(terms[-1])
            terms = paired
            if len(terms) > 1:
                power = self.mul(power, power)
        return terms[0]

    def text(self) -> str:
        return "\n".join([*self.entry, *self.lines])


def function(
    name: str, width: int, arity: int, body: Callable[[IRBuilder, list[str]], str], *, attributes: str = "alwaysinline"
) -> str:
    """The definition of a function of `arity` vectors that returns one vector; `body` writes it."""
    w = IRBuilder(width)
    args = [f"%a{k}" for k in range(arity)]
    result = body(w, args)
    head = ", ".join(f"{w.vector} {a}" for a in args)
    return (
        f"define internal {w.vector} @{name}({head}) {attributes} {{\nentry:\n{w.text()}\n"
        f"  ret {w.vector} {result}\n}}\n"
    )
