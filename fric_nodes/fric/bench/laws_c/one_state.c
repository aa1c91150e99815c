/* One body on bristles with one state, with Coulomb, Stribeck and viscous friction: implicit midpoint rule, secant method.
 *
 * The same equations, trials and tolerances as fric/engine/contact.py and effects/presliding_*.py, written by hand for one law,
 * which the compiler is told with -D. p: mass, Coulomb force, Stribeck force, velocity and exponent, the law's own parameters,
 * viscous coefficient.
 */
#include <math.h>
#include <stddef.h>

#define LOCAL static inline __attribute__((always_inline))

typedef const double *values;

LOCAL double level(values p, double v)
{
    double ratio = fabs(v) * (1.0 / p[3]);
    double fall = p[4] == 2.0 ? ratio * ratio : p[4] == 1.0 ? ratio : pow(ratio, p[4]);
    double total = fall > 80.0 ? p[1] : p[1] + p[2] * exp(-fall);
    return total > 0.0 ? total : 0.0;
}

#include "one_state_laws.h"

LOCAL double friction_over(values p, double z, double *z_next, double v, double h)
{
    double g = level(p, v);
    if (g <= 0.0) {
        *z_next = 0.0;
        return 0.0;
    }
    return slip(p, z, z_next, v, h, g);
}

LOCAL double solve(values p, double z, double *z_next, double v, double u, double h, double *friction)
{
    double half = h * (0.5 / p[0]);
    double w_a = v, z_a, z_b;
    double force_a = VISCOUS * w_a, friction_a = friction_over(p, z, &z_a, w_a, h);
    double w_b = v + half * (u - force_a - friction_a);
    double change = fabs(w_b - v);
    for (int trial = 0; trial < 50; ++trial) {
        double force_b = VISCOUS * w_b, friction_b = friction_over(p, z, &z_b, w_b, h);
        double excess = w_b - v - half * (u - force_b - friction_b);
        double rise = w_b - w_a + half * (force_b - force_a + friction_b - friction_a);
        double share = rise != 0.0 ? -excess / rise : 0.0;
        double move = share * (w_b - w_a);
        if (fabs(move) <= 5e-3 * change) {
            *z_next = z_b + share * (z_b - z_a);
            *friction = friction_b + share * (friction_b - friction_a);
            return w_b + move;
        }
        w_a = w_b;
        force_a = force_b;
        friction_a = friction_b;
        z_a = z_b;
        w_b += move;
    }
    *z_next = z_a;
    *friction = friction_a;
    return w_a;
}

LOCAL double step(values p, double *q_at, double *v_at, double *z_at, double u, double h)
{
    double q = *q_at, v = *v_at, z = *z_at, left = h, part = h, impulse = 0.0, z_next = z;
    for (int attempt = 0; attempt < 3; ++attempt) {
        double friction, w = solve(p, z, &z_next, v, u, part, &friction), v_1 = 2.0 * w - v;
        if (attempt == 0 && v * v_1 < 0.0) {
            part = h * v / (v - v_1);
            continue;
        }
        q += part * w;
        v = v_1;
        impulse += part * friction;
        left -= part;
        z = z_next;
        if (left <= 0.0)
            break;
        part = left;
    }
    *q_at = q;
    *v_at = v;
    *z_at = z;
    return impulse / h;
}

void run(const double *restrict p, const double *restrict u, size_t n, double h, double load, double temperature,
         double *restrict x, double *restrict z, double *restrict x_out, double *restrict friction_out,
         double *restrict applied_out)
{
    double q = x[0], v = x[1], bristle = z[0];
    for (size_t k = 0; k < n; ++k) {
        friction_out[k] = step(p, &q, &v, &bristle, u[k], h);
        x_out[2 * k] = q;
        x_out[2 * k + 1] = v;
        applied_out[k] = u[k];
    }
    x[0] = q;
    x[1] = v;
    z[0] = bristle;
}
