"""The two kernels, in LLVM IR.

`simulation_kernel`: lanes are candidates; each task integrates one block of lanes through one trial.
`evaluation_kernel`: lanes are rows; each task evaluates nodes on one chunk of rows for one candidate.

Both take their tasks from a shared counter until none is left, so any number of threads may run the same kernel on
the same context, and the result of a task does not depend on the thread that runs it. A context is a table of 64-bit
words, addresses and sizes, in the order of SIMULATION_CONTEXT and EVALUATION_CONTEXT.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Literal

from seatruth.simulate.compiler.llvm_ir import FLAGS, IRBuilder, double
from seatruth.simulate.compiler.lowering import frontier, lower
from seatruth.simulate.compiler.node import BOTH, LANE, ROW, Node
from seatruth.simulate.compiler.trace import Driven
from seatruth.simulate.compiler.vector_math import declarations, definitions

Mode = Literal["squared errors", "record", "stages"]
"""Whether a kernel sums the squared errors of the outputs, records them, or records the states at every stage too."""

SIMULATION_CONTEXT: Final = (
    *("counter", "tasks", "trials", "samples", "parameters", "x0", "start", "substeps", "length", "stage_start"),
    *("stage_features", "step_features", "sample_features", "weighted_measured", "weights", "sums", "x_end", "record"),
    *("stage_states", "stages"),
)
EVALUATION_CONTEXT: Final = ("counter", "tasks", "chunks", "chunk", "rows", "leaves", "parameters", "values")

STAGES = ((0.5, 1.0 / 6.0, 0), (0.5, 1.0 / 3.0, 1), (1.0, 1.0 / 3.0, 1), (0.0, 1.0 / 6.0, 2))
"""The classical Runge-Kutta step, by stage: reach of the next stage over h, weight over h, and which of the step's
three rows of inputs (start, middle, end)."""


def row_features(roots: Sequence[Node]) -> list[Node]:
    """Nodes of inputs and time alone that the roots use: computed once for all candidates, not in the kernel."""
    return frontier(roots, ROW, BOTH)


def servo_values(driven: Sequence[Driven]) -> list[Node]:
    """What the servos give in a step."""
    return [value for servo in driven for value in (servo.start, servo.middle, servo.end)]


def simulation_kernel(
    width: int,
    mode: Mode,
    states: Sequence[Node],
    rates: Sequence[Node],
    outputs: Sequence[Node],
    parameters: Sequence[Node],
    driven: Sequence[Driven],
) -> str:
    """The kernel that simulates; `parameters` are the leaves that a candidate sets, `driven` inputs behind servos."""
    w = IRBuilder(width)
    v = w.vector
    context, at = read_context(w, SIMULATION_CONTEXT)
    samples = context["samples"]
    x = [w.put(f"alloca {v}, align 64") for _ in states]
    sums = [w.put(f"alloca {v}, align 64") for _ in outputs] if mode == "squared errors" else []
    reach, total = ([w.put(f"alloca {v}, align 64") for _ in states] for _ in range(2))
    acting = [w.put(f"alloca [3 x {v}], align 64") for _ in driven]
    stage_row = w.put("alloca i64")
    task = next_task(w, context, at)
    block = w.put(f"sdiv i64 {task}, {context['trials']}")
    trial = w.put(f"srem i64 {task}, {context['trials']}")
    known = {id(node): _lane(w, at["parameters"], block, len(parameters), n) for n, node in enumerate(parameters)}
    servos = servo_values(driven)
    roots = [*rates, *outputs, *servos]
    known = lower(w, frontier(roots, LANE, BOTH), known)
    for n, slot in enumerate(x):
        w.do(f"store {v} {_lane(w, at['x0'], task, len(states), n)}, ptr {slot}")
    for q in sums:
        w.do(f"store {v} {w.constant(0.0)}, ptr {q}")
    begin = load_integer(w, at["start"], trial)
    after = load_integer(w, at["start"], w.put(f"add i64 {trial}, 1"))
    last = w.put(f"sub i64 {after}, 1")
    w.do(f"store i64 {load_integer(w, at['stage_start'], trial)}, ptr {stage_row}")
    w.do("br label %sample")

    w.label("sample")
    k = w.name()
    k_next = w.name()
    w.lines.append(f"  {k} = phi i64 [ {begin}, %task ], [ {k_next}, %sampled ]")
    here = known | _loaded(w, states, x)
    here |= {id(servo.acting): here[id(servo.state)] for servo in driven}
    here |= _features(w, row_features(outputs), at["sample_features"], k)
    found = lower(w, outputs, here)
    for d, output in enumerate(outputs):
        y = found[id(output)]
        if mode == "squared errors":
            place = w.put(f"add i64 {w.put(f'mul i64 {k}, {len(outputs)}')}, {d}")
            weight = w.splat(load_double(w, at["weights"], place))
            aim = w.splat(load_double(w, at["weighted_measured"], place))
            error = w.put(f"fsub {FLAGS} {v} {aim}, {w.binary('fmul', weight, y, FLAGS)}")
            old = w.put(f"load {v}, ptr {sums[d]}")
            squared = w.binary("fmul", error, error, FLAGS)
            w.do(f"store {v} {w.binary('fadd', old, squared, FLAGS)}, ptr {sums[d]}")
        else:
            row = w.put(f"add i64 {w.put(f'mul i64 {block}, {samples}')}, {k}")
            _store_lane(w, at["record"], row, len(outputs), d, y)
    at_end = w.put(f"icmp eq i64 {k}, {last}")
    diverged = w.put(f"xor i1 {_any_finite(w, [here[id(s)] for s in states])}, true")
    stop = w.put(f"or i1 {at_end}, {diverged}")
    w.do(f"br i1 {stop}, label %done, label %interval")

    w.label("interval")
    steps = load_integer(w, at["substeps"], k)
    h = w.splat(load_double(w, at["length"], k))
    w.do("br label %step")

    w.label("step")
    j, j_next = w.name(), w.name()
    w.lines.append(f"  {j} = phi i64 [ 0, %interval ], [ {j_next}, %stepped ]")
    for a, b, c in zip(x, reach, total):
        now = w.put(f"load {v}, ptr {a}")
        w.do(f"store {v} {now}, ptr {b}")
        w.do(f"store {v} {now}, ptr {c}")
    row0 = w.put(f"load i64, ptr {stage_row}")
    if driven:
        here = known | _loaded(w, states, x)
        here |= _features(w, row_features(servos), at["step_features"], w.put(f"sdiv i64 {row0}, 3"))
        found = lower(w, servos, here)
        for servo, slots in zip(driven, acting):
            for number, value in enumerate((servo.start, servo.middle, servo.end)):
                w.do(f"store {v} {found[id(value)]}, ptr {_slot(w, slots, str(number))}")
    w.do("br label %stage")
    w.label("stage")
    m, m_next = w.name(), w.name()
    w.lines.append(f"  {m} = phi i64 [ 0, %step ], [ {m_next}, %stage ]")
    stage = load_integer(w, "@stage.row", m)
    row = w.put(f"add i64 {row0}, {stage}")
    there = {id(servo.acting): w.put(f"load {v}, ptr {_slot(w, slots, stage)}") for servo, slots in zip(driven, acting)}
    if mode == "stages":
        _record_stage(w, reach, at["stage_states"], context["stages"], row0, m)
    shares = w.splat(load_double(w, "@stage.share", m)), w.splat(load_double(w, "@stage.ahead", m))
    scale = w.binary("fmul", h, shares[0], FLAGS), w.binary("fmul", h, shares[1], FLAGS)
    _stage(w, states, rates, known | there, x, reach, total, at["stage_features"], row, scale)
    w.do(f"{m_next} = add i64 {m}, 1")
    w.do(f"br i1 {w.put(f'icmp eq i64 {m_next}, 4')}, label %stepped, label %stage, !llvm.loop !1")

    w.label("stepped")
    for a, c in zip(x, total):
        w.do(f"store {v} {w.put(f'load {v}, ptr {c}')}, ptr {a}")
    places = {id(state): slot for state, slot in zip(states, x)}
    for servo, slots in zip(driven, acting):
        end = w.put(f"load {v}, ptr {_slot(w, slots, '2')}")
        w.do(f"store {v} {end}, ptr {places[id(servo.state)]}")
    w.do(f"store i64 {w.put(f'add i64 {row0}, 3')}, ptr {stage_row}")
    w.do(f"{j_next} = add i64 {j}, 1")
    w.do(f"br i1 {w.put(f'icmp slt i64 {j_next}, {steps}')}, label %step, label %sampled")

    w.label("sampled")
    w.do(f"{k_next} = add i64 {k}, 1")
    w.do("br label %sample")

    w.label("done")
    for s, slot in enumerate(x):
        _store_lane(w, at["x_end"], task, len(states), s, w.put(f"load {v}, ptr {slot}"))
    for d, q in enumerate(sums):
        _store_lane(w, at["sums"], task, len(outputs), d, w.put(f"load {v}, ptr {q}"))
    w.do("br label %next")
    return module(w)


def _stage(
    w: IRBuilder,
    states: Sequence[Node],
    rates: Sequence[Node],
    known: dict[int, str],
    x: Sequence[str],
    reach: Sequence[str],
    total: Sequence[str],
    features: str,
    row: str,
    scale: tuple[str, str],
) -> None:
    """One stage of a step: rates at the state `reach`, added to `total`; then `reach` for the next stage."""
    v = w.vector
    here = known | _loaded(w, states, reach) | _features(w, row_features(rates), features, row)
    found = lower(w, rates, here)
    for n, rate in enumerate(rates):
        change = found[id(rate)]
        old = w.put(f"load {v}, ptr {total[n]}")
        w.do(f"store {v} {w.binary('fadd', old, w.binary('fmul', scale[0], change, FLAGS), FLAGS)}, ptr {total[n]}")
        base = w.put(f"load {v}, ptr {x[n]}")
        ahead = w.binary("fadd", base, w.binary("fmul", scale[1], change, FLAGS), FLAGS)
        w.do(f"store {v} {ahead}, ptr {reach[n]}")


def _record_stage(w: IRBuilder, reach: Sequence[str], base: str, stages: str, row0: str, m: str) -> None:
    """Stores the states of the first lane at a stage: base[state][4 step + stage]."""
    first = w.put(f"mul i64 {w.put(f'sdiv i64 {row0}, 3')}, 4")
    place = w.put(f"add i64 {first}, {m}")
    for n, slot in enumerate(reach):
        value = w.put(f"extractelement {w.vector} {w.put(f'load {w.vector}, ptr {slot}')}, i32 0")
        entry = w.put(f"add i64 {w.put(f'mul i64 {stages}, {n}')}, {place}")
        w.do(f"store double {value}, ptr {address(w, base, entry)}")


def evaluation_kernel(width: int, leaves: Sequence[Node], parameters: Sequence[Node], roots: Sequence[Node]) -> str:
    """The kernel that evaluates nodes on rows; `leaves` change by row, `parameters` by candidate."""
    w = IRBuilder(width)
    v = w.vector
    context, at = read_context(w, EVALUATION_CONTEXT)
    rows = context["rows"]
    task = next_task(w, context, at)
    candidate = w.put(f"sdiv i64 {task}, {context['chunks']}")
    number = w.put(f"srem i64 {task}, {context['chunks']}")
    first = w.put(f"mul i64 {candidate}, {len(parameters)}")
    known = {}
    for n, node in enumerate(parameters):
        place = w.put(f"add i64 {first}, {n}")
        known[id(node)] = w.splat(load_double(w, at["parameters"], place))
    known = lower(w, frontier(roots, LANE, BOTH), known)
    begin = w.put(f"mul i64 {number}, {context['chunk']}")
    wanted = w.put(f"add i64 {begin}, {context['chunk']}")
    over = w.put(f"icmp sgt i64 {wanted}, {context['rows']}")
    end = w.put(f"select i1 {over}, i64 {context['rows']}, i64 {wanted}")
    w.do("br label %row")

    w.label("row")
    k, k_next = w.name(), w.name()
    w.lines.append(f"  {k} = phi i64 [ {begin}, %task ], [ {k_next}, %row ]")
    here = dict(known)
    for n, node in enumerate(leaves):
        place = w.put(f"add i64 {w.put(f'mul i64 {rows}, {n}')}, {k}")
        here[id(node)] = w.put(f"load {v}, ptr {address(w, at['leaves'], place)}, align 8")
    found = lower(w, roots, here)
    base = w.put(f"mul i64 {candidate}, {len(roots)}")
    for n, root in enumerate(roots):
        line = w.put(f"add i64 {base}, {n}")
        place = w.put(f"add i64 {w.put(f'mul i64 {rows}, {line}')}, {k}")
        w.do(f"store {v} {found[id(root)]}, ptr {address(w, at['values'], place)}, align 8")
    w.do(f"{k_next} = add i64 {k}, {width}")
    w.do(f"br i1 {w.put(f'icmp slt i64 {k_next}, {end}')}, label %row, label %next")
    return module(w)


def module(w: IRBuilder) -> str:
    """The module of LLVM IR around the body of a kernel."""

    def table(name: str, kind: str, values: Sequence[str]) -> str:
        items = ", ".join(f"{kind} {value}" for value in values)
        return f"@{name} = private unnamed_addr constant [{len(values)} x {kind}] [{items}]\n"

    return (
        table("stage.ahead", "double", [double(stage[0]) for stage in STAGES])
        + table("stage.share", "double", [double(stage[1]) for stage in STAGES])
        + table("stage.row", "i64", [str(stage[2]) for stage in STAGES])
        + declarations(w.width)
        + '!1 = distinct !{!1, !2}\n!2 = !{!"llvm.loop.unroll.disable"}\n'
        + definitions(w.width)
        + f"define void @kernel(ptr noalias %context) nounwind {{\nentry:\n{w.text()}\nexit:\n  ret void\n}}\n"
    )


def read_context(w: IRBuilder, words: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """The words of the context as numbers, and as addresses."""
    context = {name: load_integer(w, "%context", str(n)) for n, name in enumerate(words)}
    return context, {name: w.put(f"inttoptr i64 {context[name]} to ptr") for name in words}


def next_task(w: IRBuilder, context: Mapping[str, str], at: Mapping[str, str]) -> str:
    """Takes the next task, at the label `next`, or ends the kernel; what follows is done for the task."""
    w.do("br label %next")

    w.label("next")
    task = w.put(f"atomicrmw add ptr {at['counter']}, i64 1 monotonic")
    more = w.put(f"icmp slt i64 {task}, {context['tasks']}")
    w.do(f"br i1 {more}, label %task, label %exit")

    w.label("task")
    return task


def _loaded(w: IRBuilder, nodes: Sequence[Node], slots: Sequence[str]) -> dict[int, str]:
    """The vectors in these slots, by the id of their nodes."""
    return {id(node): w.put(f"load {w.vector}, ptr {slot}") for node, slot in zip(nodes, slots)}


def address(w: IRBuilder, base: str, index: str) -> str:
    return w.put(f"getelementptr inbounds double, ptr {base}, i64 {index}")


def _slot(w: IRBuilder, base: str, index: str) -> str:
    return w.put(f"getelementptr inbounds {w.vector}, ptr {base}, i64 {index}")


def load_integer(w: IRBuilder, base: str, index: str) -> str:
    place = w.put(f"getelementptr inbounds i64, ptr {base}, i64 {index}")
    return w.put(f"load i64, ptr {place}")


def load_double(w: IRBuilder, base: str, index: str) -> str:
    return w.put(f"load double, ptr {address(w, base, index)}")


def _lane_place(w: IRBuilder, base: str, row: str, size: int, item: int) -> str:
    line = w.put(f"add i64 {w.put(f'mul i64 {row}, {size}')}, {item}")
    return address(w, base, w.put(f"mul i64 {line}, {w.width}"))


def _lane(w: IRBuilder, base: str, row: str, size: int, item: int) -> str:
    """One vector of the array base[row][item][lane]."""
    return w.put(f"load {w.vector}, ptr {_lane_place(w, base, row, size, item)}, align 8")


def _store_lane(w: IRBuilder, base: str, row: str, size: int, item: int, value: str) -> None:
    w.do(f"store {w.vector} {value}, ptr {_lane_place(w, base, row, size, item)}, align 8")


def _features(w: IRBuilder, nodes: Sequence[Node], base: str, row: str) -> dict[int, str]:
    values = {}
    for k, node in enumerate(nodes):
        place = w.put(f"add i64 {w.put(f'mul i64 {row}, {len(nodes)}')}, {k}")
        value = w.splat(load_double(w, base, place))
        values[id(node)] = w.compare("une", value, w.constant(0.0)) if node.is_condition else value
    return values


def _any_finite(w: IRBuilder, values: Sequence[str]) -> str:
    """Whether there is a lane whose states are all finite."""
    total = values[0]
    for value in values[1:]:
        total = w.add(total, value)
    return w.any(w.compare("olt", w.intrinsic("fabs", total), w.constant(float("inf"))))
