"""Shapes of eq. 14 for k = 1..50 in 200-digit arithmetic -> eq14_shapes.csv.

Columns: k, x (an exact double, printed in the shortest form that reads back), phi_k(x), dphi/dx, d2phi/dx2 with A_k = 1 and x = z / L.
The form used here is the printed one (cosh - cos - sigma (sinh - sin)): it loses 2 a / ln 10 < 137 digits of 200, so the digits
written are right, and it shares nothing with the form the program uses.
Run with python3 and mpmath: python3 make_eq14_shapes.py > eq14_shapes.csv
"""
from mpmath import cos, cosh, findroot, mp, mpf, nstr, pi, sin, sinh

mp.dps = 200


def root(k):
    # cos a + 1 / cosh a has the same roots as cos a cosh a + 1 and does not overflow the secant steps.
    return findroot(lambda a: cos(a) + 1 / cosh(a), (2 * k - 1) * pi / 2 + (mpf("0.3") if k == 1 else 0))


# Multiples of 1/32 are exact; the others are the doubles nearest to awkward numbers (layers near both ends included).
points = [i / 32 for i in range(33)] + [0.001, 0.01, 0.1, 1 / 3, 0.45, 0.7, 0.9, 0.99, 0.999]

print("k,x,phi,dphi,ddphi")
for k in range(1, 51):
    a = root(k)
    sigma = (sinh(a) - sin(a)) / (cosh(a) + cos(a))
    for x in sorted(points):
        y = a * mpf(x)
        phi = cosh(y) - cos(y) - sigma * (sinh(y) - sin(y))
        dphi = a * (sinh(y) + sin(y) - sigma * (cosh(y) - cos(y)))
        ddphi = a**2 * (cosh(y) + cos(y) - sigma * (sinh(y) + sin(y)))
        print(f"{k},{x!r},{nstr(phi, 20)},{nstr(dphi, 20)},{nstr(ddphi, 20)}")
