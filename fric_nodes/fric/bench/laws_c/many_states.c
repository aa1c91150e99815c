/* One body on many elements side by side, with Coulomb, Stribeck and viscous friction: implicit midpoint rule, secant method.
 *
 * The same equations, trials and tolerances as fric/engine/contact.py and effects/presliding_*.py, written by hand for one law,
 * which the compiler is told with -D. p: mass, Coulomb force, Stribeck force, velocity and exponent, the law's own parameters,
 * viscous coefficient.
 */
#include <math.h>
#include <stddef.h>

#define LOCAL static inline __attribute__((always_inline))
#define MOST 64

typedef const double *values;

LOCAL double level(values p, double v)
{
    double ratio = fabs(v) * (1.0 / p[3]);
    double fall = p[4] == 2.0 ? ratio * ratio : p[4] == 1.0 ? ratio : pow(ratio, p[4]);
    double total = fall > 80.0 ? p[1] : p[1] + p[2] * exp(-fall);
    return total > 0.0 ? total : 0.0;
}

#include "many_states_laws.h"

LOCAL double friction_over(values p, values k, const double *restrict z, double *restrict z_next, double v, double h)
{
    double g = level(p, v);
    if (g <= 0.0) {
        for (int n = 0; n < states(p); ++n)
            z_next[n] = 0.0;
        return 0.0;
    }
    return slip(p, k, z, z_next, v, h, g);
}

LOCAL double solve(values p, values k, const double *restrict z, double *restrict z_next, double v, double u, double h,
                   double *friction)
{
    int n_states = states(p);
    double half = h * (0.5 / p[0]), z_a[MOST];
    double w_a = v, force_a = VISCOUS * w_a, friction_a = friction_over(p, k, z, z_next, w_a, h);
    double w_b = v + half * (u - force_a - friction_a);
    double change = fabs(w_b - v);
    for (int trial = 0; trial < 50; ++trial) {
        double force_b, friction_b, excess, rise, share, move;
        for (int j = 0; j < n_states; ++j)
            z_a[j] = z_next[j];
        force_b = VISCOUS * w_b;
        friction_b = friction_over(p, k, z, z_next, w_b, h);
        excess = w_b - v - half * (u - force_b - friction_b);
        rise = w_b - w_a + half * (force_b - force_a + friction_b - friction_a);
        share = rise != 0.0 ? -excess / rise : 0.0;
        move = share * (w_b - w_a);
        if (fabs(move) <= 5e-3 * change) {
            for (int j = 0; j < n_states; ++j)
                z_next[j] += share * (z_next[j] - z_a[j]);
            *friction = friction_b + share * (friction_b - friction_a);
            return w_b + move;
        }
        w_a = w_b;
        force_a = force_b;
        friction_a = friction_b;
        w_b += move;
    }
    *friction = friction_a;
    return w_a;
}

LOCAL double step(values p, values k, double *q_at, double *v_at, double *restrict z, double u, double h)
{
    int n_states = states(p);
    double q = *q_at, v = *v_at, left = h, part = h, impulse = 0.0, z_next[MOST];
    for (int attempt = 0; attempt < 3; ++attempt) {
        double friction, w = solve(p, k, z, z_next, v, u, part, &friction), v_1 = 2.0 * w - v;
        if (attempt == 0 && v * v_1 < 0.0) {
            part = h * v / (v - v_1);
            continue;
        }
        q += part * w;
        v = v_1;
        impulse += part * friction;
        left -= part;
        for (int j = 0; j < n_states; ++j)
            z[j] = z_next[j];
        if (left <= 0.0)
            break;
        part = left;
    }
    *q_at = q;
    *v_at = v;
    return impulse / h;
}

void run(const double *restrict p, const double *restrict u, size_t n, double h, double load, double temperature,
         double *restrict x, double *restrict z, double *restrict x_out, double *restrict friction_out,
         double *restrict applied_out)
{
    double q = x[0], v = x[1], k[MOST];
    prepare(p, k);
    for (size_t i = 0; i < n; ++i) {
        friction_out[i] = step(p, k, &q, &v, z, u[i], h);
        x_out[2 * i] = q;
        x_out[2 * i + 1] = v;
        applied_out[i] = u[i];
    }
    x[0] = q;
    x[1] = v;
}
