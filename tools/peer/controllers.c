/* EMC and PID of [LPC16] as one would transcribe them to C by hand: the yardstick for the Rust steps.
 *
 * The same inputs and the same arithmetic: gyro and battery in, two rotor commands out, what was applied fed
 * back. Compiled with -O3 and called in batches from the same process as the Rust step. */
#include <math.h>
#include <stdint.h>

struct plant { double inertia, arm, pole, slope, hover, c_g1, c_g2, k_v, full; };

/* What a step answers: command, flags and the controller's view of its state, as the Rust step does. */
struct command {
    uint64_t sequence;
    double rotor[2], torque;
    uint32_t flags, controller;
    double reference, angle, rate, acceleration, disturbance, error;
};

static const struct plant P = {0.032, 0.25, 16.0, 0.0197, 2.0 * 6.0771 / 0.0197, 447.1, 1124.5, 40.0, 12.6};

static double inverse(double rate) {
    double inside = P.c_g2 * P.c_g2 + 4.0 * P.c_g1 * rate;
    return 2.0 * rate / (P.c_g2 + sqrt(inside > 0.0 ? inside : 0.0));
}

static int allocate(double difference, double volt, double rotor[2]) {
    double half = 0.5 * difference;
    int saturated = fabs(half) > P.hover;
    if (half > P.hover) half = P.hover;
    if (half < -P.hover) half = -P.hover;
    for (int i = 0; i < 2; i++) {
        double rate = P.hover + (i ? -half : half);
        double wanted = inverse(rate + P.k_v * (P.full - volt));
        double possible = wanted < 0.0 ? 0.0 : wanted > 1.0 ? 1.0 : wanted;
        saturated |= wanted != possible;
        rotor[i] = possible;
    }
    return saturated;
}

static double back(const double rotor[2], double volt) {
    double z[2];
    for (int i = 0; i < 2; i++) {
        z[i] = (P.c_g1 * rotor[i] + P.c_g2) * rotor[i] - P.k_v * (P.full - volt);
        if (z[i] < 0.0) z[i] = 0.0;
    }
    return (z[0] - z[1]) * (z[0] + z[1]) / (2.0 * P.hover);
}

/* A step is a function of settings, state, sensors and what was applied, as in any control loop: it is called once a
 * period, and its state lives in memory between two calls. */
struct sensors { double rate, voltage; };
struct emc { double beta, l[4], k[3], period, unit; };
struct emc_state { double x[3], d[2]; uint64_t sequence; };
struct pid { double k_p, k_i, k_d, period, slope; };
struct pid_state { double angle, integral, asked; int saturated; uint64_t sequence; };

__attribute__((noinline)) static void emc_step(const struct emc *c, struct emc_state *s, const struct sensors *in,
                                               const struct command *applied, struct command *out) {
    double y = c->period * in->rate;
    if (!applied->sequence) {
        s->x[0] = 0.0; s->x[1] = y; s->x[2] = 0.0; s->d[0] = s->d[1] = 0.0;
    } else {
        s->x[2] += c->beta * (back(applied->rotor, in->voltage) / c->unit);
    }
    double x0 = s->x[0], x1 = s->x[1], x2 = s->x[2], d0 = s->d[0], d1 = s->d[1];
    double u = c->k[0] * (0.0 - x0) + c->k[1] * (0.0 - x1) + c->k[2] * (0.0 - x2 - d0) - (d0 + d1 / c->beta);
    out->flags = (uint32_t)allocate(u * c->unit, in->voltage, out->rotor);
    double e = x1 - y, torque = P.inertia / (c->period * c->period);
    s->x[0] = x0 + x1;
    s->x[1] = x1 + x2 + d0 - c->l[1] * e;
    s->x[2] = (1.0 - c->beta) * x2 - c->beta * c->l[0] * e;
    s->d[0] = d0 + d1 - c->l[2] * e;
    s->d[1] = d1 - c->l[3] * e;
    out->sequence = ++s->sequence;
    out->torque = u * torque;
    out->controller = 1;
    out->reference = 0.0;
    out->angle = x0;
    out->rate = x1 / c->period;
    out->acceleration = x2 / (c->period * c->period);
    out->disturbance = d0 * torque;
    out->error = e / c->period;
}

__attribute__((noinline)) static void pid_step(const struct pid *c, struct pid_state *s, const struct sensors *in,
                                               const struct command *applied, struct command *out) {
    if (!applied->sequence) s->angle = s->integral = 0.0;
    double e = 0.0 - s->angle, part = c->k_i * c->period * s->integral;
    double torque = c->k_p * e - c->k_d * in->rate + part;
    int saturated = allocate(torque / c->slope, in->voltage, out->rotor);
    int winds_up = s->saturated && (s->asked - back(applied->rotor, in->voltage) * c->slope) * e >= 0.0;
    out->sequence = ++s->sequence;
    out->torque = torque;
    out->flags = (uint32_t)saturated;
    out->controller = 2;
    out->reference = 0.0;
    out->angle = s->angle;
    out->rate = in->rate;
    out->acceleration = 0.0;
    out->disturbance = part;
    out->error = 0.0;
    if (applied->sequence && !winds_up) s->integral += e;
    s->angle += c->period * in->rate;
    s->asked = torque;
    s->saturated = saturated;
}

/* gains: beta, l0..l3, k1..k3. inputs: n pairs of body rate [rad/s] and battery voltage [V]. Returns the sum of
 * the first rotor's commands, so that the two languages can be held together. */
double peer_emc(const double *gains, double period, const double *inputs, uint64_t n, uint64_t rounds) {
    struct emc c = {gains[0], {gains[1], gains[2], gains[3], gains[4]}, {gains[5], gains[6], gains[7]}, period,
        1.0 / (period * period * P.arm * P.slope / P.inertia)};
    struct emc_state s = {{0}};
    struct command applied = {0}, out;
    double sum = 0.0;
    for (uint64_t round = 0; round < rounds; round++)
        for (uint64_t i = 0; i < n; i++) {
            emc_step(&c, &s, (const struct sensors *)(inputs + 2 * i), &applied, &out);
            applied = out;
            sum += out.rotor[0];
        }
    return sum;
}

/* gains: k_P, k_I, k_D. */
double peer_pid(const double *gains, double period, const double *inputs, uint64_t n, uint64_t rounds) {
    struct pid c = {gains[0], gains[1], gains[2], period, P.arm * P.slope};
    struct pid_state s = {0};
    struct command applied = {0}, out;
    double sum = 0.0;
    for (uint64_t round = 0; round < rounds; round++)
        for (uint64_t i = 0; i < n; i++) {
            pid_step(&c, &s, (const struct sensors *)(inputs + 2 * i), &applied, &out);
            applied = out;
            sum += out.rotor[0];
        }
    return sum;
}
