/* Times motions of a ball, an edge a call, as planners ask that go edge by edge.
 *
 *     motions ADDRESS MAP RADIUS EDGES LENGTH X0 Y0 Z0 X1 Y1 Z1
 *
 * EDGES edges of LENGTH meters begin at random places of the box, the same each time; all are asked twice. Prints the nanoseconds
 * of an edge the second time, and how many are free.
 */
#define _POSIX_C_SOURCE 200809L
#include <mrol.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void fail(const char *message) {
    fprintf(stderr, "%s\n", message);
    exit(1);
}

static double now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

/* From 0 to 1: a linear congruence, for the same edges everywhere. */
static double random_share(void) {
    static uint64_t state = 1;
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(state >> 11) / 9007199254740992.0;
}

static float *random_edges(size_t edges, double length, const double low[3], const double high[3]) {
    float *numbers = (float *)calloc(edges, 14 * sizeof *numbers);
    size_t edge;
    int axis;
    if (numbers == NULL) fail("no memory for the edges");
    for (edge = 0; edge < edges; edge++) {
        float *of = numbers + 14 * edge;
        int along = (int)(3 * random_share());
        for (axis = 0; axis < 3; axis++) {
            of[axis] = (float)(low[axis] + random_share() * (high[axis] - low[axis]));
            of[7 + axis] = of[axis] + (axis == along ? (float)length : 0.0f);
        }
        of[6] = of[13] = 1.0f;
    }
    return numbers;
}

int main(int count, char **words) {
    mrol_error error;
    mrol_replica replica;
    mrol_body body;
    mrol_replica_options options = mrol_replica_options_default();
    mrol_motion_check check = mrol_motion_check_default();
    mrol_motion_answers answers = mrol_motion_answers_default();
    mrol_link link;
    float sphere[4] = {0}, *numbers;
    double box[6], begin = 0;
    size_t edges, edge, free_edges = 0;
    uint8_t is_free = 0;
    int i, round;
    if (count != 12) fail("motions ADDRESS MAP RADIUS EDGES LENGTH X0 Y0 Z0 X1 Y1 Z1");
    options.address = words[1], options.map = words[2];
    sphere[3] = strtof(words[3], NULL);
    edges = (size_t)strtoul(words[4], NULL, 10);
    for (i = 0; i < 6; i++) box[i] = strtod(words[6 + i], NULL);
    numbers = random_edges(edges, strtod(words[5], NULL), box, box + 3);
    memset(&link, 0, sizeof link);
    link.spheres = sphere, link.spheres_count = 1;
    if (mrol_replica_open(&options, &replica, &error) != MROL_OK) fail(error.message);
    if (mrol_body_new(&link, 1, &body, &error) != MROL_OK) fail(error.message);
    check.body = body, check.count = 2;
    answers.capacity = 1, answers.is_free = &is_free;
    for (round = 0; round < 2; round++) {
        begin = now_ns(), free_edges = 0;
        for (edge = 0; edge < edges; edge++) {
            check.configurations = numbers + 14 * edge;
            if (mrol_replica_check_motions(replica, &check, &answers, NULL, &error) != MROL_OK) fail(error.message);
            free_edges += is_free & 1;
        }
    }
    printf("%.0f ns an edge, %lu of %lu free\n", (now_ns() - begin) / (double)edges, (unsigned long)free_edges,
           (unsigned long)edges);
    mrol_body_free(body, NULL), mrol_replica_close(replica, NULL);
    free(numbers);
    return 0;
}
