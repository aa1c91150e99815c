/* Pre-sliding laws with one state: mean friction over a step at constant velocity v and slip level g; leads z to z_next.
 *
 * p as the effects have it, the law's own parameters from p[5] on.
 */

#if defined(LUGRE) /* stiffness, damping */
#define VISCOUS p[7]
LOCAL double slip(values p, double z, double *z_next, double v, double h, double g)
{
    double fading = p[5] * fabs(v) / g, r = fading * h, phi, psi, rate;
    if (r < 0.125) {
        double r2 = r * r;
        double low = 1.0 / 2.0 - r / 6.0 + r2 * (1.0 / 24.0 - r / 120.0);
        double high = 1.0 / 720.0 - r / 5040.0 + r2 * (1.0 / 40320.0 - r / 362880.0 + r2 * (1.0 / 3628800.0 - r / 39916800.0));
        psi = low + r2 * r2 * high;
        phi = 1.0 - r * psi;
    } else {
        phi = (1.0 - (r < 40.0 ? exp(-r) : 0.0)) / r;
        psi = (1.0 - phi) / r;
    }
    rate = (v - fading * z) * phi;
    *z_next = z + h * rate;
    return p[5] * (z * phi + v * h * psi) + p[6] * rate;
}

#elif defined(DAHL) /* stiffness, exponent */
#define VISCOUS p[7]
LOCAL double faded(double x, double rate)
{
    double product = rate * x;
    return fabs(product) < 1e-300 ? x : x * (-expm1(-product) / product);
}
LOCAL double progress(double rho, double e, double *mean_gone)
{
    double x = e * rho, length, gone;
    if (x <= -1.0) {
        *mean_gone = 1.0 - 1.0 / ((1.0 - e) * rho);
        return 1.0;
    }
    length = fabs(x) > 1e-300 ? rho * (log1p(x) / x) : rho;
    gone = -expm1(-length);
    if (rho * fmax(1.0, fabs(e)) < 0.05) {
        double coefficient = -rho, mean = 0.5 * rho;
        for (int k = 1; k < 16; ++k) {
            coefficient *= -rho * (1.0 + k * e) / (k + 1);
            mean -= coefficient / (k + 2);
            if (fabs(coefficient) <= 1e-18 * rho)
                break;
        }
        *mean_gone = mean;
        return gone;
    }
    *mean_gone = 1.0 - faded(length, 1.0 - e) / rho;
    return gone;
}
LOCAL double slip(values p, double z, double *z_next, double v, double h, double g)
{
    double r = p[5] * fabs(v) * h / g, length = v >= 0.0 ? g / p[5] : -g / p[5], y = 1.0 - z / length;
    double e = p[6] - 1.0, gone, gone_mean;
    if (r == 0.0 || y == 0.0) {
        *z_next = z;
        return p[5] * z;
    }
    gone = progress(e == 0.0 ? r : fmin(r * pow(fabs(y), e), 1e300), e, &gone_mean);
    *z_next = z + length * y * gone;
    return p[5] * (z + length * y * gone_mean);
}

#elif defined(ELASTO_PLASTIC) /* stiffness, damping, breakaway */
#define VISCOUS p[8]
LOCAL double falling(double eps, double scale)
{
    double sine = sin(scale * eps);
    return eps + (1.0 - eps) * sine * sine;
}
LOCAL double ramp(double eps, double r, double scale, double *integral)
{
    double fallen = 0.0, area = 0.0, k = scale * scale, gone, fall;
    for (int n = 0; n < 1000 && 2.0 * scale * eps > 1e-3; ++n) {
        double f_1 = falling(eps, scale), step = fmin(0.04 * eps / f_1, r);
        double f_2 = falling(eps - 0.5 * step * f_1, scale);
        double f_3 = falling(eps - 0.5 * step * f_2, scale);
        double f_4 = falling(eps - step * f_3, scale);
        area += step * (fallen + step * (f_1 + f_2 + f_3) / 6.0);
        fall = step * (f_1 + 2.0 * (f_2 + f_3) + f_4) / 6.0;
        fallen += fall;
        eps -= fall;
        r -= step;
        if (r <= 0.0) {
            *integral = area;
            return fallen;
        }
    }
    gone = -expm1(-r);
    fall = eps * gone * (1.0 + k * eps) / (1.0 + k * eps * gone);
    *integral = area + fallen * r + (eps * r - log1p(k * eps * gone) / k);
    return fallen + fall;
}
LOCAL double slip(values p, double z, double *z_next, double v, double h, double g)
{
    double length = g / p[5], elastic = p[7] * length, dq = v * h, end = z + dq;
    double s, x, bent, way, part, r, eps, fall, area, rise, mean;
    if ((dq >= 0.0 && end <= elastic) || (dq <= 0.0 && -end <= elastic)) {
        *z_next = end;
        return p[5] * (z + 0.5 * dq) + p[6] * v;
    }
    s = dq > 0.0 ? 1.0 : -1.0;
    x = fabs(dq);
    bent = s * z;
    way = fmax(elastic - bent, 0.0);
    part = way / x;
    r = (x - way) / length;
    eps = 1.0 - fmax(bent, elastic) / length;
    if (eps > 0.0) {
        fall = ramp(eps, r, 0.5 * 3.14159265358979323846 / (1.0 - p[7]), &area);
    } else {
        double gone = -expm1(-r);
        fall = eps * gone;
        area = eps * (r - gone);
    }
    rise = way + length * fall;
    *z_next = z + s * rise;
    mean = way * (1.0 - 0.5 * part) + length * area * (length / x);
    return p[5] * (z + s * mean) + p[6] * v * (rise / x);
}

#else
#error "choose a law"
#endif
