"""The equations of both workloads over any array library, as the peers run them.

`xp` is NumPy, jax.numpy, or a small namespace with the same names over `math` or CasADi. Everything that depends on
the parameters alone is worked out once a candidate (`diving_plane_constants`, `ship_constants`), as an expert would do
in each of these libraries. Parameters have the names of seatruth's own models, and the right-hand sides are checked
against those models in every run. Equations: Healey and Lienard 1993 with quadratic cross-flow terms (diving plane);
Yasukawa and Yoshimura 2015 with a rate-limited rudder (ship).
"""

from __future__ import annotations

from types import SimpleNamespace as Constants
from typing import Any


def diving_plane_constants(p: Any) -> Constants:
    """Dimensional coefficients of the diving plane, the heave-pitch inertia inverted."""
    r2, r3 = 0.5 * p.rho * p.L**2, 0.5 * p.rho * p.L**3
    r4, r5 = r3 * p.L, r3 * p.L**2
    a, b = p.m - r3 * p.Z_dw, -r4 * p.Z_dq
    c, d = -r4 * p.M_dw, p.I_y - r5 * p.M_dq
    det = a * d - b * c
    return Constants(
        i_u=1.0 / (p.m - r3 * p.X_du),
        X_uu=r2 * p.X_uu,
        X_wq=r3 * p.X_wq - p.m,
        X_qq=r4 * p.X_qq,
        X_T=p.X_T,
        m=p.m,
        Z_0=r2 * p.Z_0,
        Z_w=r2 * p.Z_w,
        Z_aw=r2 * p.Z_aw,
        Z_waw=r2 * p.Z_waw,
        Z_ds=r2 * p.Z_ds,
        Z_q=r3 * p.Z_q + p.m,
        Z_qaq=r4 * p.Z_qaq,
        M_w=r3 * p.M_w,
        M_aw=r3 * p.M_aw,
        M_waw=r3 * p.M_waw,
        M_ds=r3 * p.M_ds,
        M_q=r4 * p.M_q,
        M_qaq=r5 * p.M_qaq,
        zB=p.z_B * p.B,
        i11=d / det,
        i12=-b / det,
        i21=-c / det,
        i22=a / det,
    )


def diving_plane(xp: Any, s: tuple[Any, ...], i: tuple[Any, ...], k: Constants) -> tuple[Any, ...]:
    """d/dt of (u, w, q, theta, x, z) under the stern plane angle."""
    u, w, q, theta, _, _ = s
    (delta_s,) = i
    aw, aq = abs(w), abs(q)
    uu, uw, uq, ww, qq, uaw = u * u, u * w, u * q, w * aw, q * aq, u * aw
    sin, cos = xp.sin(theta), xp.cos(theta)
    X = k.X_uu * u * abs(u) + k.X_wq * w * q + k.X_qq * q * q + k.X_T
    Z = uu * (k.Z_0 + k.Z_ds * delta_s) + k.Z_w * uw + k.Z_aw * uaw + k.Z_waw * ww + k.Z_q * uq + k.Z_qaq * qq
    M = uu * (k.M_ds * delta_s) + k.M_w * uw + k.M_aw * uaw + k.M_waw * ww + k.M_q * uq + k.M_qaq * qq + k.zB * sin
    return (k.i_u * X, k.i11 * Z + k.i12 * M, k.i21 * Z + k.i22 * M, q, u * cos + w * sin, w * cos - u * sin)


def ship_constants(p: Any) -> Constants:
    """Dimensional coefficients of the MMG ship, the sway-yaw inertia inverted."""
    hull, mass = 0.5 * p.rho * p.L * p.d, p.rho * p.nabla
    m_x, m_y = 0.5 * p.rho * p.L**2 * p.d * p.m_x, 0.5 * p.rho * p.L**2 * p.d * p.m_y
    I_zG, J_z = mass * (p.k_zz * p.L) ** 2, 0.5 * p.rho * p.L**4 * p.d * p.J_z
    a, b, d = mass + m_y, p.x_G * mass, I_zG + p.x_G**2 * mass + J_z
    det = a * d - b * b
    return Constants(
        hull=hull,
        L=p.L,
        m=mass,
        m_x=mass + m_x,
        m_y=mass + m_y,
        x_G=p.x_G,
        mx_G=mass * p.x_G,
        i_u=1.0 / (mass + m_x),
        i11=d / det,
        i12=-b / det,
        i22=a / det,
        R_0=p.R_0,
        X=(p.X_vv, p.X_vr, p.X_rr, p.X_vvvv),
        Y=(p.Y_v, p.Y_r, p.Y_vvv, p.Y_vvr, p.Y_vrr, p.Y_rrr),
        N=(p.N_v, p.N_r, p.N_vvv, p.N_vvr, p.N_vrr, p.N_rrr),
        i_nD=p.D_P,
        thrust=(1.0 - p.t_P) * p.rho * p.D_P**4,
        k=(p.k_0, p.k_1, p.k_2),
        w_P0=p.w_P0,
        x_P=p.x_P,
        C_1=p.C_1,
        C_2p=p.C_2_plus - 1.0,
        C_2n=p.C_2_minus - 1.0,
        epsilon=p.epsilon,
        kappa=p.kappa,
        eta=p.D_P / p.H_R,
        gamma_n=p.gamma_R_minus,
        gamma_p=p.gamma_R_plus,
        l_R=p.l_R,
        F_N=0.5 * p.rho * p.A_R * p.f_alpha,
        X_R=-(1.0 - p.t_R),
        Y_R=-(1.0 + p.a_H),
        N_R=-(p.x_R + p.a_H * p.x_H) * p.L,
        rate=p.rudder_rate,
        i_T=1.0 / p.T_rudder,
    )


def ship(xp: Any, s: tuple[Any, ...], i: tuple[Any, ...], k: Constants) -> tuple[Any, ...]:
    """d/dt of (u, v_m, r, x, y, psi, delta) under the rudder order and the propeller's revolutions."""
    u, v, r, _, _, psi, delta = s
    order, n = i
    U = xp.sqrt(u * u + v * v)
    v1, r1 = v / U, r * k.L / U
    vv, vr, rr = v1 * v1, v1 * r1, r1 * r1
    q = k.hull * U * U
    X_H = q * (-k.R_0 + k.X[0] * vv + k.X[1] * vr + k.X[2] * rr + k.X[3] * vv * vv)
    Y_H = q * (v1 * (k.Y[0] + k.Y[2] * vv + k.Y[3] * vr + k.Y[4] * rr) + r1 * (k.Y[1] + k.Y[5] * rr))
    N_H = q * k.L * (v1 * (k.N[0] + k.N[2] * vv + k.N[3] * vr + k.N[4] * rr) + r1 * (k.N[1] + k.N[5] * rr))
    beta = xp.arctan2(-v, u)
    beta_P = beta - k.x_P * r1
    C_2 = xp.where(beta_P > 0.0, k.C_2p, k.C_2n)
    w_P = 1.0 - (1.0 - k.w_P0) * (1.0 + (1.0 - xp.exp(-k.C_1 * abs(beta_P))) * C_2)
    J = u * (1.0 - w_P) / (n * k.i_nD)
    K_T = k.k[0] + J * (k.k[1] + J * k.k[2])
    X_P = k.thrust * n * n * K_T
    slip = 1.0 + k.kappa * (xp.sqrt(1.0 + 8.0 * K_T / (3.141592653589793 * J * J)) - 1.0)
    u_R = k.epsilon * u * (1.0 - w_P) * xp.sqrt(k.eta * slip * slip + 1.0 - k.eta)
    beta_R = beta - k.l_R * r1
    v_R = U * xp.where(beta_R > 0.0, k.gamma_p, k.gamma_n) * beta_R
    F_N = k.F_N * (u_R * u_R + v_R * v_R) * xp.sin(delta - xp.arctan2(v_R, u_R))
    F_c = F_N * xp.cos(delta)
    X = X_H + X_P + k.X_R * F_N * xp.sin(delta) + k.m_y * v * r + k.mx_G * r * r
    Y = Y_H + k.Y_R * F_c - k.m_x * u * r
    N = N_H + k.N_R * F_c - k.mx_G * u * r
    sin, cos = xp.sin(psi), xp.cos(psi)
    turn = xp.minimum(xp.maximum((order - delta) * k.i_T, -k.rate), k.rate)
    return (
        k.i_u * X,
        k.i11 * Y + k.i12 * N,
        k.i12 * Y + k.i22 * N,
        u * cos - v * sin,
        u * sin + v * cos,
        r,
        turn,
    )


def rk4(xp: Any, rhs: Any, s: tuple[Any, ...], inputs: tuple[Any, Any, Any], k: Constants, h: float) -> tuple[Any, ...]:
    """One classical Runge-Kutta step; `inputs` are those at the start, the middle and the end of the step."""
    k1 = rhs(xp, s, inputs[0], k)
    k2 = rhs(xp, tuple(x + 0.5 * h * d for x, d in zip(s, k1)), inputs[1], k)
    k3 = rhs(xp, tuple(x + 0.5 * h * d for x, d in zip(s, k2)), inputs[1], k)
    k4 = rhs(xp, tuple(x + h * d for x, d in zip(s, k3)), inputs[2], k)
    return tuple(x + (h / 6.0) * (a + 2.0 * (b + c) + d) for x, a, b, c, d in zip(s, k1, k2, k3, k4))
