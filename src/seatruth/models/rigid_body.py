"""Vectors, attitude and the solution for the accelerations, which models of six degrees of freedom share."""

from __future__ import annotations

import math
from typing import Any

Vector = tuple[Any, Any, Any]


def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def plus(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    total = vectors[0]
    for v in vectors[1:]:
        total = (total[0] + v[0], total[1] + v[1], total[2] + v[2])
    return total


def kinematics(s: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """d/dt of x, y, z, phi, theta, psi."""
    cf, sf = math.cos(s.phi), math.sin(s.phi)
    ct, st = math.cos(s.theta), math.sin(s.theta)
    cp, sp = math.cos(s.psi), math.sin(s.psi)
    ahead = ct * s.u + st * (sf * s.v + cf * s.w)
    across = cf * s.v - sf * s.w
    turn = (sf * s.q + cf * s.r) / ct
    return (
        cp * ahead - sp * across,
        sp * ahead + cp * across,
        -st * s.u + ct * (sf * s.v + cf * s.w),
        s.p + st * turn,
        cf * s.q - sf * s.r,
        turn,
    )


def solved(matrix: tuple[tuple[Any, ...], ...], right: tuple[Any, ...]) -> list[Any]:
    """Solution x (n,) of matrix (n, n) x = right (n,), the matrix symmetric and positive definite (L D L')."""
    size = len(right)
    lower: list[list[Any]] = [[0.0] * size for _ in range(size)]
    pivot: list[Any] = []
    x = list(right)
    for j in range(size):
        d = matrix[j][j]
        for k in range(j):
            d = d - lower[j][k] * lower[j][k] * pivot[k]
        pivot.append(d)
        for row in range(j + 1, size):
            entry = matrix[row][j]
            for k in range(j):
                entry = entry - lower[row][k] * lower[j][k] * pivot[k]
            lower[row][j] = entry / d
    for j in range(size):
        for k in range(j):
            x[j] = x[j] - lower[j][k] * x[k]
    x = [x[j] / pivot[j] for j in range(size)]
    for j in reversed(range(size)):
        for k in range(j + 1, size):
            x[j] = x[j] - lower[k][j] * x[k]
    return x
