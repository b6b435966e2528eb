"""The kernel that carries derivatives through a simulation, the same for every model.

The derivatives X of the states along a direction obey the linearized equations X' = A(t) X + b(t), whose coefficients
are derivatives of the rates along the run. Differentiating each stage of the Runge-Kutta step gives the exact
derivatives of the discrete run. The coefficients are evaluated before, for all rows at once; here lanes are directions,
and each task takes one block of them through one stretch of a trial. A and b are lists of the entries that are not
zero, so that the work is that of the couplings that exist.

A context is a table of 64-bit words in the order of PROPAGATION_CONTEXT. Lists are in compressed rows: the entries
`a_start[i]` to `a_start[i + 1] - 1` belong to row i of A. C and d are the same for the outputs. Those of b and d belong
to row i of a block.
"""

from __future__ import annotations

from typing import Final

from seatruth.simulate.compiler.kernels import (
    STAGES,
    address,
    load_double,
    load_integer,
    module,
    next_task,
    read_context,
)
from seatruth.simulate.compiler.llvm_ir import IRBuilder, double

PROPAGATION_CONTEXT: Final = (
    *("counter", "tasks", "todo", "blocks", "samples", "states", "outputs", "first", "length", "substeps"),
    *("rate_values", "output_values", "record", "x", "scratch"),
    *("a_start", "a_from", "a_place", "b_start", "b_lane", "b_place"),
    *("c_start", "c_from", "c_place", "d_start", "d_lane", "d_place"),
)
"""`todo` (tasks,): the blocks of this stretch in which anything moves; the others stay zero. `x` (blocks, S, width):
derivatives at the stretch's begin, then at its end. `record` (samples of all trials, D,
blocks, width), where the stretch begins at sample `first`. `scratch` (blocks, 3, S, width). Of each entry: the state
(`from`) or the lane that it multiplies, and its place among the values, where its own rows begin."""


def propagation_kernel(width: int) -> str:
    """The kernel, for blocks of so many directions."""
    w = IRBuilder(width)
    v = w.vector
    context, at = read_context(w, PROPAGATION_CONTEXT)
    states, outputs, first_sample = context["states"], context["outputs"], context["first"]
    size = w.put(f"mul i64 {states}, {width}")
    step, sum_slot = w.put("alloca i64"), w.put(f"alloca {v}, align 64")
    block = load_integer(w, at["todo"], next_task(w, context, at))
    x = address(w, at["x"], w.put(f"mul i64 {block}, {size}"))
    total = address(w, at["scratch"], w.put(f"mul i64 {block}, {w.put(f'mul i64 {size}, 3')}"))
    buffers = [address(w, total, size), address(w, total, w.put(f"mul i64 {size}, 2"))]
    own_rates = w.put(f"mul i64 {block}, {states}")
    own_outputs = w.put(f"mul i64 {block}, {outputs}")
    w.do(f"store i64 0, ptr {step}")

    def vector_at(base: str, item: str) -> str:
        return address(w, base, w.put(f"mul i64 {item}, {width}"))

    def load(base: str, item: str) -> str:
        return w.put(f"load {v}, ptr {vector_at(base, item)}, align 8")

    def row_sum(what: str, row: str, own: str, own_row: str, values: str, vectors: str, k: str) -> str:
        """Row `row` of the matrix `what` times the vectors, plus row `own_row` of the lanes' own entries."""
        w.do(f"store {v} {w.constant(0.0)}, ptr {sum_slot}")
        for name, where in ((what, row), (own, own_row)):
            begin = load_integer(w, at[f"{name}_start"], where)
            entry = _Loop(w, begin, load_integer(w, at[f"{name}_start"], w.put(f"add i64 {where}, 1")))
            place = w.put(f"add i64 {load_integer(w, at[f'{name}_place'], entry.index)}, {k}")
            value = w.splat(load_double(w, values, place))
            if name == what:
                factor = load(vectors, load_integer(w, at[f"{name}_from"], entry.index))
            else:
                factor = load("@one", load_integer(w, at[f"{name}_lane"], entry.index))
            so_far = w.put(f"load {v}, ptr {sum_slot}")
            w.do(f"store {v} {w.fma(value, factor, so_far)}, ptr {sum_slot}")
            entry.close()
        return w.put(f"load {v}, ptr {sum_slot}")

    sample = _Loop(w, "0", context["samples"])
    k = sample.index
    row = w.put(f"mul i64 {w.put(f'add i64 {first_sample}, {k}')}, {outputs}")
    output = _Loop(w, "0", outputs)
    d = output.index
    slope = row_sum("c", d, "d", w.put(f"add i64 {own_outputs}, {d}"), at["output_values"], x, k)
    place = w.put(f"mul i64 {w.put(f'add i64 {row}, {d}')}, {context['blocks']}")
    w.do(f"store {v} {slope}, ptr {vector_at(at['record'], w.put(f'add i64 {place}, {block}'))}, align 8")
    output.close()
    h = w.splat(load_double(w, at["length"], k))

    steps = _Loop(w, "0", load_integer(w, at["substeps"], k))
    copy = _Loop(w, "0", states)
    now = load(x, copy.index)
    for target in (total, buffers[0]):
        w.do(f"store {v} {now}, ptr {vector_at(target, copy.index)}, align 8")
    copy.close()
    number = w.put(f"load i64, ptr {step}")
    first = w.put(f"mul i64 {number}, 4")
    for m, (ahead, share, _) in enumerate(STAGES):
        here, there = buffers[m % 2], buffers[1 - m % 2]
        stage = w.put(f"add i64 {first}, {m}")
        state = _Loop(w, "0", states)
        i = state.index
        slope = row_sum("a", i, "b", w.put(f"add i64 {own_rates}, {i}"), at["rate_values"], here, stage)
        old = load(total, i)
        weight = w.mul(h, w.constant(share))
        w.do(f"store {v} {w.fma(weight, slope, old)}, ptr {vector_at(total, i)}, align 8")
        if ahead:
            reach = w.fma(w.mul(h, w.constant(ahead)), slope, load(x, i))
            w.do(f"store {v} {reach}, ptr {vector_at(there, i)}, align 8")
        state.close()
    back = _Loop(w, "0", states)
    w.do(f"store {v} {load(total, back.index)}, ptr {vector_at(x, back.index)}, align 8")
    back.close()
    w.do(f"store i64 {w.put(f'add i64 {number}, 1')}, ptr {step}")
    steps.close()
    sample.close()
    w.do("br label %next")
    lanes = ", ".join(f"double {double(float(a == b))}" for a in range(width) for b in range(width))
    table = f"@one = private unnamed_addr constant [{width * width} x double] [{lanes}]\n"
    return table + module(w)


class _Loop:
    """A loop over `index` from `begin` to `end` - 1; what is written until `close` is its body."""

    def __init__(self, w: IRBuilder, begin: str, end: str) -> None:
        self._w = w
        self._label = w.name()[1:]
        self.index, self._next = w.name(), w.name()
        w.do(f"br label %{self._label}_before")
        w.label(f"{self._label}_before")
        w.do(f"br label %{self._label}_head")
        w.label(f"{self._label}_head")
        latch = f"[ {self._next}, %{self._label}_latch ]"
        w.do(f"{self.index} = phi i64 [ {begin}, %{self._label}_before ], {latch}")
        more = w.put(f"icmp slt i64 {self.index}, {end}")
        w.do(f"br i1 {more}, label %{self._label}_body, label %{self._label}_exit")
        w.label(f"{self._label}_body")

    def close(self) -> None:
        """Ends the body."""
        w = self._w
        w.do(f"br label %{self._label}_latch")
        w.label(f"{self._label}_latch")
        w.do(f"{self._next} = add i64 {self.index}, 1")
        w.do(f"br label %{self._label}_head")
        w.label(f"{self._label}_exit")
