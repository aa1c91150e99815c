/* The laws: slip level and force of a contact at one instant. p: mass, Coulomb force, then as each law says.
 *
 * Laws with memory define MEMORY, see it in c, and lead it on in remember().
 */

struct at {
    double position, velocity, side, time, load, temperature, acceleration, step, memory, begun;
};

#define PI 3.14159265358979323846

#if defined(COULOMB_VISCOUS) /* coefficient */
LOCAL double level(values p, struct at c) { return p[1]; }
LOCAL double force(values p, struct at c) { return p[2] * c.velocity; }

#elif defined(STRIBECK) /* force, velocity, exponent; viscous */
LOCAL double level(values p, struct at c)
{
    double ratio = fabs(c.velocity) * (1.0 / p[3]);
    double fall = p[4] == 2.0 ? ratio * ratio : p[4] == 1.0 ? ratio : pow(ratio, p[4]);
    return fall > 80.0 ? p[1] : p[1] + p[2] * exp(-fall);
}
LOCAL double force(values p, struct at c) { return p[5] * c.velocity; }

#elif defined(HESS_SOOM) /* force, velocity; viscous */
LOCAL double level(values p, struct at c)
{
    double ratio = c.velocity * (1.0 / p[3]);
    return p[1] + p[2] / (1.0 + ratio * ratio);
}
LOCAL double force(values p, struct at c) { return p[4] * c.velocity; }

#elif defined(STATIC) /* force; viscous */
LOCAL double level(values p, struct at c) { return c.velocity == 0.0 ? p[1] + p[2] : p[1]; }
LOCAL double force(values p, struct at c) { return p[3] * c.velocity; }

#elif defined(ACCEL_HYSTERESIS) /* force, velocity; viscous */
#define ACCELERATION
LOCAL double level(values p, struct at c)
{
    double ratio = c.velocity * (1.0 / p[3]);
    return c.side * c.acceleration < 0.0 ? p[1] : p[1] + p[2] / (1.0 + ratio * ratio);
}
LOCAL double force(values p, struct at c) { return p[4] * c.velocity; }

#elif defined(QUADRATIC) /* coefficient */
LOCAL double level(values p, struct at c) { return p[1]; }
LOCAL double force(values p, struct at c) { return p[2] * c.velocity * fabs(c.velocity); }

#elif defined(ASYMMETRY) /* force, coefficient; viscous */
LOCAL double level(values p, struct at c) { return p[1] + c.side * p[2]; }
LOCAL double force(values p, struct at c) { return p[3] * fabs(c.velocity) + p[4] * c.velocity; }

#elif defined(BIAS) /* force */
LOCAL double level(values p, struct at c) { return p[1]; }
LOCAL double force(values p, struct at c) { return p[2]; }

#elif defined(RIPPLE) /* cosine, sine, period */
LOCAL double level(values p, struct at c) { return p[1]; }
LOCAL double force(values p, struct at c)
{
    double wave = 2.0 * PI / p[4], phase = wave * c.position;
    double reach = 0.5 * wave * c.velocity * c.step, r = reach * reach;
    double mean = r < 0.01 ? 1.0 - r * (1.0 / 6.0 - r * (1.0 / 120.0 - r / 5040.0)) : sin(reach) / reach;
    return (p[2] * cos(phase) + p[3] * sin(phase)) * mean;
}

#elif defined(STIFFNESS) /* stiffness, position */
LOCAL double level(values p, struct at c) { return p[1]; }
LOCAL double force(values p, struct at c) { return p[2] * (c.position - p[3]); }

#elif defined(NONLINEAR_STIFFNESS) /* stiffness, position */
LOCAL double level(values p, struct at c) { return p[1]; }
LOCAL double force(values p, struct at c)
{
    double deflection = c.position - p[3], reach = 0.5 * c.velocity * c.step;
    return p[2] * deflection * (deflection * deflection + reach * reach);
}

#elif defined(LOAD) /* coefficient; viscous */
LOCAL double level(values p, struct at c) { return p[1] * (1.0 + p[2] * (c.load - 1.0)); }
LOCAL double force(values p, struct at c) { return p[3] * c.velocity; }

#elif defined(LOAD_PROPORTIONAL) /* force; viscous */
LOCAL double level(values p, struct at c) { return p[1] + p[2] * c.load; }
LOCAL double force(values p, struct at c) { return p[3] * c.velocity; }

#elif defined(POSITION_PERIODIC) /* cosine, sine, period; viscous */
LOCAL double level(values p, struct at c)
{
    double phase = 2.0 * PI / p[4] * c.position;
    return p[1] * (1.0 + p[2] * cos(phase) + p[3] * sin(phase));
}
LOCAL double force(values p, struct at c) { return p[5] * c.velocity; }

#elif defined(POSITION_LOCAL) /* amplitude, position, width; viscous */
LOCAL double level(values p, struct at c)
{
    double distance = (c.position - p[3]) / p[4], fall = 0.5 * distance * distance;
    return fall > 80.0 ? p[1] : p[1] * (1.0 + p[2] * exp(-fall));
}
LOCAL double force(values p, struct at c) { return p[5] * c.velocity; }

#elif defined(TEMPERATURE) /* change of the level, of the viscous coefficient; viscous */
LOCAL double level(values p, struct at c) { return p[1] * (1.0 + p[2] * c.temperature); }
LOCAL double force(values p, struct at c) { return p[3] * c.temperature * c.velocity + p[4] * c.velocity; }

#elif defined(DRIFT_LINEAR) /* rate; viscous */
LOCAL double level(values p, struct at c) { return p[1] * (1.0 + p[2] * c.time); }
LOCAL double force(values p, struct at c) { return p[3] * c.velocity; }

#elif defined(DRIFT_EXPONENTIAL) /* change, time; viscous */
LOCAL double level(values p, struct at c) { return p[1] * (1.0 - p[2] * expm1(-c.time / p[3])); }
LOCAL double force(values p, struct at c) { return p[4] * c.velocity; }

#elif defined(LAG) /* Stribeck force, velocity, exponent; time; viscous */
#define MEMORY
LOCAL double mean_decay(double r) { return r > 0.0 ? -expm1(-r) / r : 1.0; }
LOCAL double steady(values p, struct at c)
{
    double ratio = fabs(c.velocity) * (1.0 / p[3]);
    double fall = p[4] == 2.0 ? ratio * ratio : p[4] == 1.0 ? ratio : pow(ratio, p[4]);
    return fall > 80.0 ? p[1] : p[1] + p[2] * exp(-fall);
}
LOCAL double level(values p, struct at c)
{
    double base = steady(p, c);
    return c.begun == 0.0 ? base : base + (c.memory - base) * mean_decay(c.step / p[5]);
}
LOCAL double force(values p, struct at c) { return p[6] * c.velocity; }
LOCAL double remember(values p, struct at c)
{
    double base = steady(p, c);
    return c.begun == 0.0 ? base : base + (c.memory - base) * exp(-c.step / p[5]);
}

#else /* the laws of dwell time: the age of the contact is its memory */
#define MEMORY
LOCAL double mean_decay(double r) { return r > 0.0 ? -expm1(-r) / r : 1.0; }
LOCAL double aged(struct at c, double length)
{
    double half = 0.5 * c.step, r = fabs(c.velocity) * half / length;
    return c.memory * exp(-r) + half * mean_decay(r);
}
LOCAL double older(struct at c, double length)
{
    double r = fabs(c.velocity) * c.step / length;
    return c.memory * exp(-r) + c.step * mean_decay(r);
}
#if defined(DWELL_EXPONENTIAL) /* force, initial, time, exponent, length; viscous */
#define LENGTH p[6]
#define VISCOUS p[7]
LOCAL double level(values p, struct at c)
{
    double rest = exp(-pow(aged(c, LENGTH) / p[4], p[5]));
    return p[1] + p[2] * (1.0 - rest) + p[3] * rest;
}
#elif defined(DWELL_EXPONENTIAL_POWER) /* force, time, exponent, power, length; viscous */
#define LENGTH p[6]
#define VISCOUS p[7]
LOCAL double level(values p, struct at c) { return p[1] + p[2] * pow(-expm1(-pow(aged(c, LENGTH) / p[3], p[4])), p[5]); }
#elif defined(DWELL_HYPERBOLIC) /* force, initial, time, length; viscous */
#define LENGTH p[5]
#define VISCOUS p[6]
LOCAL double level(values p, struct at c)
{
    double age = aged(c, LENGTH), risen = age / (age + p[4]);
    return p[1] + p[3] * (1.0 - risen) + p[2] * risen;
}
#elif defined(DWELL_LOGARITHMIC) /* force, initial, time, length; viscous */
#define LENGTH p[5]
#define VISCOUS p[6]
LOCAL double level(values p, struct at c) { return p[1] + p[3] + p[2] * log1p(aged(c, LENGTH) / p[4]); }
#elif defined(DWELL_ROOT) /* force, ratio, time, length; viscous */
#define LENGTH p[5]
#define VISCOUS p[6]
LOCAL double level(values p, struct at c)
{
    double rest = 1.0 / sqrt(aged(c, LENGTH) / p[4] + 1.0);
    return p[1] + p[2] / ((p[3] - 1.0) * rest + 1.0);
}
#elif defined(DWELL_POWER) /* force, exponent, length; viscous */
#define LENGTH p[4]
#define VISCOUS p[5]
LOCAL double level(values p, struct at c) { return p[1] + p[2] * pow(aged(c, LENGTH), p[3]); }
#else
#error "choose a law"
#endif
LOCAL double force(values p, struct at c) { return VISCOUS * c.velocity; }
LOCAL double remember(values p, struct at c) { return older(c, LENGTH); }
#endif
