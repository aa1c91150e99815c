/* One body with friction that is a function of what can be seen now, or of one memory, and exact stick: implicit midpoint rule, secant method.
 *
 * m dv/dt = u - F - side max(level, 0); the same equations, trials and tolerances as fric/engine/contact.py, written by hand for
 * one law, which the compiler is told with -D.
 */
#include <math.h>
#include <stddef.h>

#define LOCAL static inline __attribute__((always_inline))

typedef const double *values;

#include "algebraic_laws.h"

struct around {
    double time, load, temperature, memory, begun;
};

LOCAL double larger(double a, double b) { return a > b ? a : b; }

LOCAL struct at seen(double q, double v, double side, double time, struct around o, double bend, double h)
{
    return (struct at){q, v, side, time, o.load, o.temperature, bend, h, o.memory, o.begun};
}

/* Force and friction over h at the mean velocity w. */
LOCAL double opposing(values p, double q, double w, double h, double side, double bend, struct around o, double *friction)
{
    struct at c = seen(q + 0.5 * w * h, w, side, o.time + 0.5 * h, o, bend, h);
    *friction = side * larger(level(p, c), 0.0);
    return force(p, c);
}

/* Mean velocity over h when sliding towards side throughout, and the mean friction force there. */
LOCAL double solve(values p, double q, double v, double u, double h, double side, struct around o, double *friction)
{
    double half = h * (0.5 / p[0]), bend = 0.0, friction_a, friction_b;
    double w_a, force_a, w_b, change;
#ifdef ACCELERATION
    double friction_up, friction_down;
    double force_up = opposing(p, q, v, h, side, 1.0, o, &friction_up);
    double force_down = opposing(p, q, v, h, side, -1.0, o, &friction_down);
    if (u - force_up - friction_up > 0.0) {
        bend = 1.0;
    } else if (u - force_down - friction_down < 0.0) {
        bend = -1.0;
    } else {
        *friction = u - force_up;
        return v;
    }
#endif
    w_a = v;
    force_a = opposing(p, q, w_a, h, side, bend, o, &friction_a);
    w_b = v + half * (u - force_a - friction_a);
    change = fabs(w_b - v);
    for (int trial = 0; trial < 50; ++trial) {
        double force_b = opposing(p, q, w_b, h, side, bend, o, &friction_b);
        double excess = w_b - v - half * (u - force_b - friction_b);
        double rise = w_b - w_a + half * (force_b - force_a + friction_b - friction_a);
        double share = rise != 0.0 ? -excess / rise : 0.0;
        double move = share * (w_b - w_a);
        if (fabs(move) <= 5e-3 * change) {
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

LOCAL double step(values p, double *q_at, double *v_at, double u, double h, struct around o)
{
    double q = *q_at, v = *v_at, left = h, impulse = 0.0;
    for (int part = 0; part < 8; ++part) {
        double side = v > 0.0 ? 1.0 : -1.0, push = 0.0, friction, w, v_1, braking, stop;
        if (v == 0.0) {
            push = u - force(p, seen(q, 0.0, 1.0, o.time, o, 0.0, left));
            side = push > 0.0 ? 1.0 : -1.0;
            if (fabs(push) <= larger(level(p, seen(q, 0.0, side, o.time, o, side, left)), 0.0)) {
                impulse += push * left;
                break;
            }
        }
        w = solve(p, q, v, u, left, side, o, &friction);
        v_1 = 2.0 * w - v;
        if (v_1 * side >= 0.0) {
            q += left * w;
            v = v_1;
            impulse += friction * left;
            break;
        }
        if (v == 0.0) {
            impulse += push * left;
            break;
        }
        w = 0.5 * v;
        stop = left;
        for (int trial = 0; trial < 3; ++trial) {
            struct at c = seen(q + 0.5 * w * stop, w, side, o.time, o, -side, stop);
            friction = side * larger(level(p, c), 0.0);
            braking = side * (force(p, c) + friction - u);
            stop = braking * left > p[0] * fabs(v) ? p[0] * fabs(v) / braking : left;
        }
        q += w * stop;
        impulse += friction * stop;
        v = 0.0;
        left -= stop;
        if (left <= 0.0)
            break;
    }
    *q_at = q;
    *v_at = v;
    return impulse / h;
}

void run(const double *restrict p, const double *restrict u, size_t n, double h, double load, double temperature,
         double *restrict x, double *restrict z, double *restrict x_out, double *restrict friction_out,
         double *restrict applied_out)
{
    double q = x[0], v = x[1];
#ifdef MEMORY
    double memory = z[0], begun = 0.0;
#endif
    for (size_t k = 0; k < n; ++k) {
#ifdef MEMORY
        struct around o = {k * h, load, temperature, memory, begun};
        double q_0 = q, w;
        friction_out[k] = step(p, &q, &v, u[k], h, o);
        w = (q - q_0) / h;
        memory = remember(p, seen(0.5 * (q_0 + q), w, w < 0.0 ? -1.0 : 1.0, o.time + 0.5 * h, o, 0.0, h));
        begun = 1.0;
#else
        struct around o = {k * h, load, temperature, 0.0, 0.0};
        friction_out[k] = step(p, &q, &v, u[k], h, o);
#endif
        x_out[2 * k] = q;
        x_out[2 * k + 1] = v;
        applied_out[k] = u[k];
    }
    x[0] = q;
    x[1] = v;
}
