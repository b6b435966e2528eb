"""JAX (compiled scan over a mapped population) and diffrax (adaptive Tsit5), in double precision on all cores.

XLA runs such small operations on one thread; to give JAX all cores, the population is also split over as many host
devices as there are cores (`XLA_FLAGS`, set before JAX is imported). Every form is timed and the best one counts.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engines.equations import rk4
from engines.workloads import Workload

Array = NDArray[np.float64]


def load(threads: int) -> Any:
    """Imports JAX with one host device a thread and 64-bit numbers."""
    os.environ["XLA_FLAGS"] = f"--xla_force_host_platform_device_count={threads}"
    os.environ["JAX_PLATFORMS"] = "cpu"
    os.environ["JAX_ENABLE_X64"] = "1"
    import jax

    return jax


class Jax:
    """RK4 in a `lax.scan`; forms: "vmap" (mapped over candidates), "batched" (arrays over candidates), both split."""

    forms = ("vmap", "vmap split", "batched", "batched split")

    def __init__(self, workload: Workload, threads: int) -> None:
        self.jax, self.workload, self.threads = load(threads), workload, threads
        jnp = self.jax.numpy
        self._scan_in = (jnp.asarray(workload.step_inputs), jnp.asarray(workload.measured[1:]))
        self._calls: dict[str, Callable[[Any], Any]] = {
            "vmap": self.jax.jit(self.jax.vmap(self._cost)),
            "batched": self.jax.jit(lambda theta: self._cost(theta.T)),
        }
        self._derivative = self.jax.jit(self.jax.jacfwd(self._outputs))

    def costs(self, theta: Array, form: str = "vmap") -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        kind, _, split = form.partition(" ")
        return _spread(self.jax, self._calls[kind], theta, self.threads if split else 1)

    def jacobian(self, theta: Array) -> Array:
        """Derivatives of all outputs; shape (N - 1, D, K)."""
        return np.asarray(self._derivative(theta).block_until_ready())

    def _cost(self, theta: Any) -> Any:
        job, jnp = self.workload, self.jax.numpy
        k = job.constants(job.parameters(theta))

        def error(s: tuple[Any, ...], y: Any) -> Any:
            return sum((w * (y[n] - s[j])) ** 2 for n, (j, w) in enumerate(zip(job.observed, job.weights)))

        def step(carry: Any, given: Any) -> tuple[Any, None]:
            s, total = carry
            inputs, y = given
            s = rk4(jnp, job.rhs, s, _columns(inputs, job), k, job.h)
            return (s, total + error(s, y)), None

        shape = theta.shape[1:]
        first = tuple(jnp.full(shape, x) for x in job.x0)
        (_, total), _ = self.jax.lax.scan(step, (first, error(first, job.measured[0])), self._scan_in)
        return total

    def _outputs(self, theta: Any) -> Any:
        job, jnp = self.workload, self.jax.numpy
        k = job.constants(job.parameters(theta))

        def step(s: Any, inputs: Any) -> tuple[Any, Any]:
            s = rk4(jnp, job.rhs, s, _columns(inputs, job), k, job.h)
            return s, jnp.stack([s[j] for j in job.observed])

        first = tuple(jnp.asarray(x) for x in job.x0)
        return self.jax.lax.scan(step, first, self._scan_in[0])[1]


class Diffrax:
    """Tsit5, relative and absolute tolerance 1e-6, mapped over candidates, whole and split over the cores."""

    forms = ("vmap", "vmap split")

    def __init__(self, workload: Workload, threads: int) -> None:
        self.jax, self.workload, self.threads = load(threads), workload, threads
        self._call = self.jax.jit(self.jax.vmap(self._cost))

    def costs(self, theta: Array, form: str = "vmap") -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        return _spread(self.jax, self._call, theta, self.threads if form.endswith("split") else 1)

    def _cost(self, theta: Any) -> Any:
        import diffrax

        job, jnp = self.workload, self.jax.numpy
        k = job.constants(job.parameters(theta))
        inputs, last = jnp.asarray(job.inputs), len(job.t) - 1

        def rhs(t: Any, s: Any, _: Any) -> Any:
            place = t / job.h
            n = jnp.clip(place.astype(int), 0, last - 1)
            part = 0.0 if job.hold == "zoh" else place - n
            now = inputs[n] + part * (inputs[n + 1] - inputs[n])
            return jnp.stack(job.rhs(jnp, tuple(s[j] for j in range(len(job.x0))), tuple(now), k))

        run = diffrax.diffeqsolve(
            diffrax.ODETerm(rhs),
            diffrax.Tsit5(),
            t0=0.0,
            t1=float(job.t[-1]),
            dt0=job.h,
            y0=jnp.asarray(job.x0),
            saveat=diffrax.SaveAt(ts=jnp.asarray(job.t)),
            stepsize_controller=diffrax.PIDController(rtol=1e-6, atol=1e-6),
            max_steps=100_000,
        )
        errors = (jnp.asarray(job.measured) - run.ys[:, jnp.asarray(job.observed)]) * jnp.asarray(job.weights)
        return jnp.sum(errors * errors)


def _columns(inputs: Any, job: Workload) -> tuple[Any, Any, Any]:
    start, middle, end = (tuple(inputs[stage, n] for n in range(job.inputs.shape[1])) for stage in range(3))
    return start, middle, end


def _spread(jax: Any, call: Callable[[Any], Any], theta: Array, parts: int) -> Array:
    """Runs a mapped function with the population split over `parts` host devices (padded to a multiple)."""
    if parts == 1 or len(theta) < parts:
        return np.asarray(call(theta).block_until_ready())
    pad = -len(theta) % parts
    whole = np.concatenate([theta, theta[:1].repeat(pad, axis=0)]) if pad else theta
    mesh = jax.sharding.Mesh(np.array(jax.devices()[:parts]), ("candidates",))
    place = jax.sharding.NamedSharding(mesh, jax.sharding.PartitionSpec("candidates"))
    return np.asarray(call(jax.device_put(whole, place)).block_until_ready())[: len(theta)]
