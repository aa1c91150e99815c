/* Pre-sliding laws with many elements: mean friction over a step at constant velocity v and slip level g.
 *
 * Leads the states z to z_next; k holds constants that prepare() has made. The law's own parameters start at p[5].
 */

#if defined(GMS) /* stiffness, attraction, exponent, elements, damping; z: deflections, then 1 for each that slides */
#define VISCOUS p[10]
typedef struct {
    double end, mean, way, on;
} element;

LOCAL int states(values p) { return 2 * (int)(p[8] + 0.5); }

LOCAL void prepare(values p, double *k)
{
    double total = 0.0;
    int m = (int)(p[8] + 0.5);
    for (int n = 0; n < m; ++n) {
        k[n] = 1.0 - pow(1.0 - (n + 0.5) / m, 1.0 / p[7]);
        total += k[n];
    }
    for (int n = 0; n < m; ++n)
        k[n] *= m / (total * p[5]);
}

LOCAL double fading(double r, double *mean)
{
    double e;
    if (r < 1e-3) {
        *mean = 1.0 - r * (0.5 - r * (1.0 / 6.0 - r / 24.0));
        return 1.0 - r * (1.0 - r * (0.5 - r / 6.0));
    }
    e = exp(-r);
    *mean = (1.0 - e) / r;
    return e;
}

LOCAL double pulled_up(double d, double limit, double x, double r, double *mean)
{
    double start = limit - x / r, stick, e, e_mean, gap;
    if (start - d >= x) {
        *mean = d + 0.5 * x;
        return d + x;
    }
    stick = (start - d) / x;
    e = fading(r * (1.0 - stick), &e_mean);
    gap = start - limit;
    *mean = 0.5 * stick * (d + start) + (1.0 - stick) * (limit + gap * e_mean);
    return limit + gap * e;
}

LOCAL double unloaded(double d, double limit, double x, double r, double *mean, double *share)
{
    double over = -limit - d, e, e_mean;
    *mean = d;
    *share = 0.0;
    if (over * r <= x)
        return d;
    *share = x > 0.0 ? fmin(log(over * r / x) / r, 1.0) : 1.0;
    e = fading(r * *share, &e_mean);
    *mean = -limit - over * e_mean;
    return -limit - over * e;
}

LOCAL element stuck(double d, double limit, double x, double r)
{
    double before = 0.0, used = 0.0, left, way, room, stick;
    if (d < -limit)
        d = unloaded(d, limit, x, r, &before, &used);
    left = 1.0 - used;
    way = left * x;
    room = limit - d;
    if (way < room)
        return (element){d + way, used * before + left * (d + 0.5 * way), x, 0.0};
    stick = way > 0.0 ? room / way : 0.0;
    return (element){limit, used * before + left * (limit - 0.5 * room * stick), used * x + room, 1.0};
}

LOCAL double slip(values p, values k, const double *restrict z, double *restrict z_next, double v, double h, double g)
{
    int m = (int)(p[8] + 0.5);
    double s = v >= 0.0 ? 1.0 : -1.0, x = fabs(v) * h, r = p[6] * h / g;
    double e = -1.0, e_mean = 0.0, bent = 0.0, followed = 0.0;
    for (int n = 0; n < m; ++n) {
        double d = s * z[n], limit = k[n] * g, gap = d - limit;
        element now;
        if (gap > 0.0 || (d > 0.0 && z[m + n] > 0.5)) {
            if (gap == 0.0) {
                now.end = now.mean = d;
            } else if (x >= -r * gap) {
                if (e < 0.0)
                    e = fading(r, &e_mean);
                now.end = limit + gap * e;
                now.mean = limit + gap * e_mean;
            } else {
                now.end = pulled_up(d, limit, x, r, &now.mean);
            }
            now.way = now.end > d ? now.end - d : 0.0;
            now.on = 1.0;
        } else if (x < -gap && d >= -limit) {
            now = (element){d + x, d + 0.5 * x, x, 0.0};
        } else {
            now = stuck(d, limit, x, r);
        }
        z_next[n] = s * now.end;
        z_next[m + n] = now.on;
        bent += now.mean;
        followed += now.way;
    }
    if (v == 0.0)
        for (int n = 0; n < m; ++n)
            z_next[m + n] = z[m + n];
    return (s * p[5] * bent + p[9] * v * (x > 0.0 ? followed / x : 0.0)) / m;
}

#elif defined(MAXWELL_SLIP) /* ten times stiffness and limit; z: deflections */
#define VISCOUS p[25]
#define ELEMENTS 10

LOCAL int states(values p) { return ELEMENTS; }

LOCAL void prepare(values p, double *k)
{
    double total = 0.0;
    for (int n = 0; n < ELEMENTS; ++n)
        total += p[5 + 2 * n] * p[6 + 2 * n];
    for (int n = 0; n < ELEMENTS; ++n) {
        k[n] = p[5 + 2 * n];
        k[ELEMENTS + n] = k[n] > 0.0 ? p[6 + 2 * n] / total : 0.0;
    }
}

LOCAL double slip(values p, values k, const double *restrict z, double *restrict z_next, double v, double h, double g)
{
    double dq = v * h, mean = 0.0;
    for (int n = 0; n < ELEMENTS; ++n) {
        double limit = k[ELEMENTS + n] * g, d = z[n] < -limit ? -limit : z[n], end, way = 0.5 * dq, room;
        d = d > limit ? limit : d;
        end = d + dq;
        if (fabs(end) > limit) {
            end = copysign(limit, dq);
            room = end - d;
            way = room - 0.5 * room * (room / dq);
        }
        z_next[n] = end;
        mean += k[n] * (d + way);
    }
    return mean;
}

#else
#error "choose a law"
#endif
