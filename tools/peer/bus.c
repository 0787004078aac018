/* Frame in to frame out on a CAN bus: the yardstick's loop and the stopwatch.
 *
 *     bus echo IFACE
 *         the minimal loop: blocks in read, answers each frame 700 with a frame 010. Until killed.
 *     bus pair IFACE
 *         the same by two processes: one reads the bus and hands each frame 700 through shared memory and a futex to
 *         the other, which hands the answer back the same way, and the first one writes it. Until killed.
 *     bus probe IFACE ID COUNT PERIOD_US
 *         sends COUNT frames ID, one a period, each followed by a wait for the frame 010, and prints the times
 *         in between [ns], one a line; after each answer it plays the ESCs, so that a guard may be open.
 *
 * Both sides of the comparison are measured by this one program. ID is 020 (the IMU's frame of dbc/bench.dbc, which a
 * running bench answers with 010, its command) or 700 (which only echo and pair answer). */
#define _GNU_SOURCE
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/futex.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { COMMAND = 0x010, GYRO = 0x020, ESC_1 = 0x041, ESC_2 = 0x042, ECHO = 0x700 };

static int open_bus(const char *name, canid_t only) {
    int s = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(name)};
    struct can_filter filter = {only, CAN_SFF_MASK};
    if (s < 0 || setsockopt(s, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter) != 0
        || bind(s, (struct sockaddr *)&address, sizeof address) != 0) {
        perror(name);
        exit(2);
    }
    return s;
}

static long long now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1000000000LL * t.tv_sec + t.tv_nsec;
}

static void echo(int s) {
    struct can_frame in, out = {.can_id = COMMAND, .can_dlc = 8};
    while (read(s, &in, sizeof in) == (ssize_t)sizeof in) {
        memcpy(out.data, in.data, 8);
        if (write(s, &out, sizeof out) != (ssize_t)sizeof out) perror("write");
    }
}

/* One direction of the handover: a frame, and how often one was put there. */
struct hand { _Atomic unsigned count; struct can_frame frame; };

static void give(struct hand *hand, const struct can_frame *frame) {
    hand->frame = *frame;
    atomic_fetch_add(&hand->count, 1);
    syscall(SYS_futex, &hand->count, FUTEX_WAKE, 1, NULL, NULL, 0);
}

/* The frame after the `seen`-th one; waits for it. */
static struct can_frame await(struct hand *hand, unsigned seen) {
    while (atomic_load(&hand->count) == seen) syscall(SYS_futex, &hand->count, FUTEX_WAIT, seen, NULL, NULL, 0);
    return hand->frame;
}

static void pair(int s) {
    struct hand *hands = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (hands == MAP_FAILED) { perror("mmap"); exit(2); }
    pid_t first = getpid(), second = fork();
    if (second < 0) { perror("fork"); exit(2); }
    if (second == 0) {
        /* A priority lower, where there is one: whoever is woken goes on at once, as `control` lets `bridge`. */
        struct sched_param p;
        if (sched_getparam(0, &p) == 0 && p.sched_priority > 1) {
            p.sched_priority--;
            sched_setparam(0, &p);
        }
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != first) _exit(0);
        mlockall(MCL_CURRENT | MCL_FUTURE); /* Which a child does not inherit. */
        for (unsigned seen = 0;; seen++) {
            struct can_frame in = await(&hands[0], seen), out = {.can_id = COMMAND, .can_dlc = 8};
            memcpy(out.data, in.data, 8);
            give(&hands[1], &out);
        }
    }
    struct can_frame in;
    for (unsigned seen = 0; read(s, &in, sizeof in) == (ssize_t)sizeof in; seen++) {
        give(&hands[0], &in);
        struct can_frame out = await(&hands[1], seen);
        if (write(s, &out, sizeof out) != (ssize_t)sizeof out) perror("write");
    }
}

static void put(int s, canid_t id, unsigned char counter, const void *bytes, size_t length, size_t at) {
    struct can_frame frame = {.can_id = id, .can_dlc = 8};
    frame.data[0] = counter;
    memcpy(frame.data + at, bytes, length);
    if (write(s, &frame, sizeof frame) != (ssize_t)sizeof frame) perror("write");
}

/* The next frame within `patience_ms`, or not. */
static int get(int s, int patience_ms) {
    struct can_frame frame;
    struct pollfd p = {s, POLLIN, 0};
    return poll(&p, 1, patience_ms) > 0 && read(s, &frame, sizeof frame) == (ssize_t)sizeof frame;
}

static int probe(int s, canid_t id, int count, int period_us) {
    long long start = now();
    int lost = 0, stray = 0;
    for (int k = 0; k < count; k++) {
        /* A period after the last one, however late that was: frames that come in a bunch are not what an IMU sends. */
        long long next = start + 1000LL * period_us;
        struct timespec t = {next / 1000000000LL, next % 1000000000LL};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
        while (get(s, 0)) stray++;
        float rate = 1e-4f * (float)(k % 7 - 3);
        start = now();
        put(s, id, (unsigned char)k, &rate, sizeof rate, 4);
        if (get(s, 200)) printf("%lld\n", now() - start);
        else lost++;
        short speed = (short)(12000 + k % 5), rest[3] = {speed, 12400, 100};
        put(s, ESC_1, (unsigned char)k, rest, sizeof rest, 2);
        put(s, ESC_2, (unsigned char)k, rest, sizeof rest, 2);
    }
    fprintf(stderr, "bus probe %03X: %d sent, %d without an answer, %d frames not asked for\n", id, count, lost, stray);
    return lost > count / 10;
}

int main(int count, char **words) {
    mlockall(MCL_CURRENT | MCL_FUTURE);
    if (count == 3 && !strcmp(words[1], "echo")) {
        echo(open_bus(words[2], ECHO));
        return 1;
    }
    if (count == 3 && !strcmp(words[1], "pair")) {
        pair(open_bus(words[2], ECHO));
        return 1;
    }
    if (count == 6 && !strcmp(words[1], "probe")) {
        canid_t id = (canid_t)strtoul(words[3], NULL, 16);
        return probe(open_bus(words[2], COMMAND), id, atoi(words[4]), atoi(words[5]));
    }
    fprintf(stderr, "usage: bus echo IFACE | bus pair IFACE | bus probe IFACE ID COUNT PERIOD_US\n");
    return 2;
}
