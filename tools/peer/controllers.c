/* EMC and PID of [LPC16] as one would transcribe them to C by hand: the yardstick for the Rust steps.
 *
 * The same inputs and the same arithmetic: gyro and battery in, two rotor commands out, what was applied fed
 * back. Compiled with -O3 and called in batches from the same process as the Rust step. */
#include <math.h>
#include <stdint.h>

struct plant { double inertia, arm, pole, slope, hover, c_g1, c_g2, k_v, full; };

/* What a step answers: command, flags and the controller's view of its state, as the Rust step does. */
struct command {
    uint64_t sequence, answers;
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

static void keep(const struct command *command) { __asm__ volatile("" : : "r"(command) : "memory"); }

/* gains: beta, l0..l3, k1..k3. inputs: n pairs of body rate [rad/s] and battery voltage [V]. Returns the sum of
 * the first rotor's commands, so that the two languages can be held together. */
double peer_emc(const double *gains, double period, const double *inputs, uint64_t n, uint64_t rounds) {
    double beta = gains[0];
    const double *l = gains + 1, *k = gains + 5;
    double b = P.arm * P.slope / P.inertia;
    double unit = 1.0 / (period * period * b);
    double x[3] = {0, 0, 0}, d[2] = {0, 0}, rotor[2] = {0, 0}, sum = 0.0;
    int applied = 0;
    for (uint64_t step = 0; step < n * rounds; step++) {
        double rate = inputs[2 * (step % n)], volt = inputs[2 * (step % n) + 1];
        double y = period * rate;
        if (!applied) {
            x[0] = 0.0; x[1] = y; x[2] = 0.0; d[0] = d[1] = 0.0; applied = 1;
        } else {
            x[2] += beta * (back(rotor, volt) / unit);
        }
        double u = k[0] * (0.0 - x[0]) + k[1] * (0.0 - x[1]) + k[2] * (0.0 - x[2] - d[0]) - (d[0] + d[1] / beta);
        int saturated = allocate(u * unit, volt, rotor);
        double e = x[1] - y;
        struct command command = {step + 1, step % n, {rotor[0], rotor[1]}, u * P.inertia / (period * period),
            (uint32_t)saturated, 1, 0.0, x[0], x[1] / period, x[2] / (period * period),
            d[0] * P.inertia / (period * period), e / period};
        keep(&command);
        double x0 = x[0] + x[1], x1 = x[1] + x[2] + d[0] - l[1] * e;
        x[2] = (1.0 - beta) * x[2] - beta * l[0] * e;
        x[0] = x0; x[1] = x1;
        d[0] = d[0] + d[1] - l[2] * e;
        d[1] -= l[3] * e;
        sum += rotor[0];
    }
    return sum;
}

/* gains: k_P, k_I, k_D. */
double peer_pid(const double *gains, double period, const double *inputs, uint64_t n, uint64_t rounds) {
    double slope = P.inertia * (P.arm * P.slope / P.inertia);
    double angle = 0.0, integral = 0.0, asked = 0.0, rotor[2] = {0, 0}, sum = 0.0;
    int applied = 0, saturated = 0;
    for (uint64_t step = 0; step < n * rounds; step++) {
        double rate = inputs[2 * (step % n)], volt = inputs[2 * (step % n) + 1];
        if (!applied) { angle = 0.0; integral = 0.0; }
        double e = 0.0 - angle;
        double torque = gains[0] * e - gains[2] * rate + gains[1] * period * integral;
        int now = allocate(torque / slope, volt, rotor);
        if (applied && !(saturated && (asked - back(rotor, volt) * slope) * e >= 0.0)) integral += e;
        struct command command = {step + 1, step % n, {rotor[0], rotor[1]}, torque, (uint32_t)now, 2, 0.0, angle,
            rate, 0.0, gains[1] * period * integral, 0.0};
        keep(&command);
        angle += period * rate;
        asked = torque;
        saturated = now;
        applied = 1;
        sum += rotor[0];
    }
    return sum;
}
