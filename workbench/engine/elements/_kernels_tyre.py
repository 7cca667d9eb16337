# mypy: ignore-errors
"""Tyre on a road, compiled: Pacejka's formula of 1989 with relaxation, and smooth road profiles.

    F(x) = D sin(C atan(B x - E (B x - atan(B x)))),   B = (B C D)/(C D)                 Fz in kN, F in N
    lateral       C = a0, D = a1 Fz^2 + a2 Fz, BCD = a3 sin(2 atan(Fz/a4)), E = a6 Fz + a7,      x in degrees
    longitudinal  C = b0, D = b1 Fz^2 + b2 Fz, BCD = (b3 Fz^2 + b4 Fz) exp(-b5 Fz),
                  E = b6 Fz^2 + b7 Fz + b8,                                                     x in per cent

(Bakker, Pacejka and Lidner 1989.) D is scaled by the friction over its reference; the slip stiffness stays.
Combined slip by similarity: with slips over those of the peaks, sx = k/km, sy = a/am and s = |(sx, sy)|,
Fx = sx/s Fx0(s km), Fy = sy/s Fy0(s am): a friction ellipse, exact for pure slip. Slips are states,

    k' = -(vx + |Vx| k)/relaxation,   a' = -(vy + |Vx| a)/relaxation

vx, vy: velocity of the contact patch of the wheel, Vx that of its centre, |Vx| = sqrt(Vx^2 + slow^2).

Numbers p: 0 radius, 1 vertical stiffness, 2 damping at the nominal load (N s/m), 3 nominal load (N), 4
width (m), 5 friction over its reference, 6 relaxation (m), 7 slow speed, 8 km (1), 9 am (rad), 10 rolling
resistance, 11:19 a0..a7, 19:28 b0..b8, 28:31 axis of the wheel in its frame.
Road r: 0 amplitude, 1 wave number, 2:4 direction, 4 start, 5 ramp (m); 6 kerb height, 7 place, 8:10
direction, 10 width; then amplitude, wave number, phase of further waves.
"""

from numba import njit
from numpy import arctan, cos, exp, sin, sqrt

from ..compiler.options import INNER
from ._kernels_contact import normal_force
from ._kernels_rounding import ramp, saturated, smoothstep

DEGREES = 57.29577951308232
NEAR = 1e-18
FLAT = 1e-12  # a wheel that lies flat is far off the road


@njit(**INNER)
def road(r, x, y, out):
    """Height of the road at (x, y); out (2,) its slopes. Waves behind a smooth ramp, and a smooth kerb."""
    s = r[2] * x + r[3] * y - r[4]
    on, on1 = smoothstep(s / r[5])
    wave = r[0] * sin(r[1] * s)
    rise = r[0] * r[1] * cos(r[1] * s)
    for i in range(11, r.shape[0], 3):
        wave += r[i] * sin(r[i + 1] * s + r[i + 2])
        rise += r[i] * r[i + 1] * cos(r[i + 1] * s + r[i + 2])
    slope = on * rise + on1 / r[5] * wave
    up, up1 = smoothstep((r[8] * x + r[9] * y - r[7]) / r[10])
    kerb = r[6] * up1 / r[10]
    out[0] = slope * r[2] + kerb * r[8]
    out[1] = slope * r[3] + kerb * r[9]
    return on * wave + r[6] * up


@njit(**INNER)
def magic(c, d, bcd, e, x):
    """D sin(C atan(B x - E (B x - atan(B x))))."""
    b = bcd / (c * d) * x
    return d * sin(c * arctan(b - e * (b - arctan(b))))


@njit(**INNER)
def lateral(p, fz, slip):
    """Force of a pure slip angle (tangent) at a load in N; odd in the slip."""
    a, z = p[11:], 1e-3 * fz
    d = p[5] * (a[1] * z + a[2])
    u = z / a[4]
    bcd = a[3] * 2.0 / (a[4] * (1.0 + u * u))  # sin(2 atan u) = 2 u/(1 + u^2)
    return z * magic(a[0], d, bcd, a[6] * z + a[7], DEGREES * arctan(slip))


@njit(**INNER)
def longitudinal(p, fz, slip):
    """Force of a pure longitudinal slip at a load in N; odd in the slip."""
    b, z = p[19:], 1e-3 * fz
    d = p[5] * (b[1] * z + b[2])
    bcd = (b[3] * z + b[4]) * exp(-b[5] * z)
    return z * magic(b[0], d, bcd, b[6] * z * z + b[7] * z + b[8], 100.0 * slip)


@njit(**INNER)
def tyre(p, r, R, centre, origin, v, w, k, a, f, arm, rates):
    """Force f and arm (from the origin) on a wheel, a moment along its axis in arm[3:6], rates of the slips.

    R: rotation by rows.  centre: less the origin.  v, w: velocity of the centre and spin.  k, a: slips.
    """
    ex = R[0] * p[28] + R[1] * p[29] + R[2] * p[30]
    ey = R[3] * p[28] + R[4] * p[29] + R[5] * p[30]
    ez = R[6] * p[28] + R[7] * p[29] + R[8] * p[30]
    height = road(r, centre[0] + origin[0], centre[1] + origin[1], rates)
    size = sqrt(1.0 + rates[0] * rates[0] + rates[1] * rates[1])
    nx, ny, nz = -rates[0] / size, -rates[1] / size, 1.0 / size
    above = (centre[2] + origin[2] - height) * nz
    # ahead e x n, sideways n x ahead, and upwards in the wheel's plane
    tx, ty, tz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
    size = sqrt(tx * tx + ty * ty + tz * tz + NEAR)
    tx, ty, tz = tx / size, ty / size, tz / size
    sx, sy, sz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    dx, dy, dz = ty * ez - tz * ey, tz * ex - tx * ez, tx * ey - ty * ex
    lift = dx * nx + dy * ny + dz * nz
    depth = p[0] - above / (lift + FLAT)
    loaded = p[0] - ramp(depth, p[4])[0]  # off the road the arm is the wheel's radius
    qx, qy, qz = -loaded * dx, -loaded * dy, -loaded * dz
    ux, uy, uz = v[0] + w[1] * qz - w[2] * qy, v[1] + w[2] * qx - w[0] * qz, v[2] + w[0] * qy - w[1] * qx
    sink = -(v[0] * nx + v[1] * ny + v[2] * nz)
    normal = normal_force(p[1], 1.0, p[2] / p[3], p[4], depth, sink)
    speed = v[0] * tx + v[1] * ty + v[2] * tz
    fast = sqrt(speed * speed + p[7] * p[7])
    rates[0] = -(ux * tx + uy * ty + uz * tz + fast * k) / p[6]
    rates[1] = -(ux * sx + uy * sy + uz * sz + fast * a) / p[6]
    km, am = p[8] * p[5], p[9] * p[5]  # the peaks move with the friction
    x, y = k / km, a / am
    s = sqrt(x * x + y * y + NEAR)
    along = x / s * longitudinal(p, normal, s * km)
    across = y / s * lateral(p, normal, s * am)
    f[0] = normal * nx + along * tx + across * sx
    f[1] = normal * ny + along * ty + across * sy
    f[2] = normal * nz + along * tz + across * sz
    arm[0] = centre[0] + qx
    arm[1] = centre[1] + qy
    arm[2] = centre[2] + qz
    roll = -p[10] * normal * p[0] * saturated(speed / p[7])
    arm[3] = roll * ex
    arm[4] = roll * ey
    arm[5] = roll * ez
