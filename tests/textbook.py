"""The paper's reflectance as textbooks write it, at 50 digits, one point at a time; shares nothing with the planner.

Fresnel's complex amplitudes (Born and Wolf, section 14.2), light as Jones vectors, Torrance-Sparrow as printed.
"""

import mpmath

mp = mpmath.MPContext()  # a context of its own: nobody else's precision changes
mp.dps = 50


def amplitudes(cosine, n, k):
    """Complex amplitudes (parallel, perpendicular) at a surface of index n - ik."""
    index, cosine = mp.mpc(n, -k), mp.mpf(cosine)
    inside = mp.sqrt(1 - (1 - cosine**2) / index**2)
    parallel = (index * cosine - inside) / (index * cosine + inside)
    return parallel, (cosine - index * inside) / (cosine + index * inside)


def beckmann(cosine, m):
    """D as printed, from the cosine alone."""
    tangent2 = 1 / cosine**2 - 1
    return mp.exp(-tangent2 / m**2) / (m**2 * cosine**4)


def attenuation(nh, nv, nl, vh):
    """G of V-cavities."""
    return min(mp.mpf(1), 2 * nh * nv / vh, 2 * nh * nl / vh)


def reflected_share(n, k, to_light, to_sensor, field=None, analyser=None):
    """Part of the light that a facet between the two directions sends on, through the analyser if there is one."""
    half = unit(plus(to_light, to_sensor))
    parallel, perpendicular = amplitudes(min(dot(half, to_sensor), mp.mpf(1)), n, k)
    into, out = times(-1, to_light), to_sensor
    s = cross(into, out)
    s = unit(s) if dot(s, s) > mp.mpf(10) ** -90 else across_any(to_light)
    p_in, p_out = cross(s, into), cross(s, out)

    def passed(electric):
        sent = plus(times(perpendicular * dot(electric, s), s), times(parallel * dot(electric, p_in), p_out))
        return sum(abs(x) ** 2 for x in sent) if analyser is None else abs(dot(sent, analyser)) ** 2

    if field is not None:
        return passed(field)
    return (passed(s) + passed(p_in)) / 2


def brightness(material, normal, to_light, to_sensor, field=None, analyser=None, index=None):
    """N.L times the paper's reflectance; vectors of unit length, polariser axes across their rays."""
    normal, to_light, to_sensor = (unit(exact(v)) for v in (normal, to_light, to_sensor))
    field, analyser = (None if a is None else unit(exact(a)) for a in (field, analyser))
    nl, nv = dot(normal, to_light), dot(normal, to_sensor)
    if nl <= 0 or nv <= 0:
        return mp.mpf(0)
    n, k = index or (material.refractive_index, material.extinction)
    s = mp.mpf(material.specular_fraction)
    half = unit(plus(to_light, to_sensor))
    nh, vh = dot(normal, half), dot(to_sensor, half)
    strength = beckmann(nh, mp.mpf(material.roughness)) * attenuation(nh, nv, nl, vh) / (mp.pi * nl * nv)
    specular = strength * reflected_share(n, k, to_light, to_sensor, field, analyser)
    diffuse = (1 - s) * mp.mpf(material.diffuse_reflectance) / (1 if analyser is None else 2)
    return nl * (s * specular + diffuse)


def exact(vector):
    return tuple(x if isinstance(x, mp.mpf) else mp.mpf(float(x)) for x in vector)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def plus(a, b):
    return tuple(x + y for x, y in zip(a, b, strict=True))


def times(factor, a):
    return tuple(factor * x for x in a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    size = mp.sqrt(dot(a, a))
    return tuple(x / size for x in a)


def across_any(a):
    """Some unit vector across another."""
    least = min(range(3), key=lambda i: abs(a[i]))
    return unit(cross(a, tuple(mp.mpf(i == least) for i in range(3))))
