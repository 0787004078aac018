/* Frames through the C that cantools generates from dbc/bench.dbc: the yardstick for the compiled codec. */
#include <stdint.h>
#include "bench.h"

/* frames: n payloads of 8 bytes. Adds up every signal of every frame. */
double peer_decode(const uint8_t *frames, uint64_t n, uint64_t rounds) {
    double sum = 0.0;
    for (uint64_t round = 0; round < rounds; round++)
        for (uint64_t i = 0; i < n; i++) {
            struct bench_esc_1_status_t m;
            if (bench_esc_1_status_unpack(&m, frames + 8 * i, 8) != 0) continue;
            sum += bench_esc_1_status_counter_decode(m.counter);
            sum += bench_esc_1_status_temperature_decode(m.temperature);
            sum += bench_esc_1_status_speed_decode(m.speed);
            sum += bench_esc_1_status_voltage_decode(m.voltage);
            sum += bench_esc_1_status_current_decode(m.current);
        }
    return sum;
}

/* values: n pairs of rotor commands. Adds up the packed bytes 2 to 5. */
double peer_encode(const double *values, uint64_t n, uint64_t rounds) {
    uint64_t sum = 0;
    for (uint64_t round = 0; round < rounds; round++)
        for (uint64_t i = 0; i < n; i++) {
            struct bench_command_t m;
            uint8_t data[8];
            bench_command_init(&m);
            m.counter = bench_command_counter_encode((double)(i & 255));
            m.state = bench_command_state_encode(2.0);
            m.rotor_1 = bench_command_rotor_1_encode(values[2 * i]);
            m.rotor_2 = bench_command_rotor_2_encode(values[2 * i + 1]);
            if (bench_command_pack(data, &m, sizeof data) < 0) continue;
            sum += data[2] + 256u * data[3] + data[4] + 256u * data[5];
        }
    return (double)sum;
}
