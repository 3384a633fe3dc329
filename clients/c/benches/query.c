/* Times queries of points through this library, when it is told to: the C half of `mrol-lab bench replica --c-client`.
 *
 *     query ADDRESS MAP POINTS_FILE X Y Z QX QY QZ QW
 *
 * A line "LOOKUP POINTS" asks about all points of the file, so many at a time, twice. Then it prints the nanoseconds that the
 * second time took, and how many points are occupied.
 */
#define _POSIX_C_SOURCE 200809L
#include <mrol.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static mrol_replica replica;
static mrol_point_query query;
static float *xyz;
static size_t count;
static uint8_t *occupied;

static void fail(const char *message) {
    printf("%s\n", message);
    exit(1);
}

static void read_points(const char *path) {
    FILE *file = fopen(path, "rb");
    long bytes;
    if (file == NULL || fseek(file, 0, SEEK_END) != 0 || (bytes = ftell(file)) < 0) fail("no file of points");
    rewind(file);
    count = (size_t)bytes / (3 * sizeof *xyz);
    xyz = (float *)malloc((size_t)bytes + 1);
    occupied = (uint8_t *)malloc(count + 1);
    if (xyz == NULL || occupied == NULL) fail("no memory for the points");
    if (fread(xyz, 3 * sizeof *xyz, count, file) != count) fail("the file of points cannot be read");
    fclose(file);
}

/* How many of all points are occupied. */
static unsigned long long pass(size_t points) {
    unsigned long long positive = 0;
    size_t first;
    for (first = 0; first < count; first += points) {
        mrol_error error;
        mrol_answer answer;
        query.xyz = xyz + 3 * first;
        query.count = count - first < points ? count - first : points;
        if (mrol_replica_query_points(replica, &query, occupied, count, &answer, &error) != MROL_OK) fail(error.message);
        positive += answer.positive;
    }
    return positive;
}

static double now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

int main(int words_count, char **words) {
    mrol_error error;
    mrol_replica_options options = mrol_replica_options_default();
    double pose[7];
    int lookup, i;
    unsigned long points;
    if (words_count != 11) fail("query ADDRESS MAP POINTS_FILE X Y Z QX QY QZ QW");
    options.address = words[1];
    options.map = words[2];
    options.with_filter = 1;
    if (mrol_replica_open(&options, &replica, &error) != MROL_OK) fail(error.message);
    read_points(words[3]);
    for (i = 0; i < 7; i++) pose[i] = strtod(words[4 + i], NULL);
    query = mrol_point_query_default();
    query.map_from_points = pose;
    printf("ready\n");
    fflush(stdout);
    while (scanf("%d %lu", &lookup, &points) == 2 && points > 0) {
        double begin;
        unsigned long long positive;
        query.lookup = lookup;
        pass(points);
        begin = now_ns();
        positive = pass(points);
        printf("%.0f %llu\n", now_ns() - begin, positive);
        fflush(stdout);
    }
    mrol_replica_close(replica, NULL);
    return 0;
}
